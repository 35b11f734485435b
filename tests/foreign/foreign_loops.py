"""Hysteresis of the film: a temperature [°C] moves a loop, the loop tells its two metallic fractions [1].

Both loops have the same two verbs: `move(temperature, latent)` and the pair `fractions` = (electrical,
structural). `latent` [K] is the temperature that a full transition would cost; `move` returns what is left.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from math import atanh, pi, sin, tanh

import numpy as np
from foreign_common import Array


class DomainLoop:
    """Independent domains: metallic once above `up`, semiconducting again once below `down` [°C]."""

    def __init__(self, up: Array, down: Array, electrical: Array, structural: Array) -> None:
        self._order_up, self._order_down = np.argsort(up), np.argsort(down)
        self._up, self._down = up[self._order_up].tolist(), down[self._order_down].tolist()
        self._weights = np.vstack([electrical / electrical.sum(), structural / structural.sum()])
        self._metal = np.zeros(up.size, dtype=bool)
        self._passed_up = self._passed_down = 0  # thresholds that the temperature has left below it
        self._fractions = np.zeros(2)

    @property
    def fractions(self) -> tuple[float, float]:
        """Metallic weight of the current's path and of the beam [1]."""
        return float(self._fractions[0]), float(self._fractions[1])

    def move(self, temperature: float, latent: float = 0.0) -> float:
        """Bring all domains to `temperature` [°C], less the latent heat [K] of those that switch."""
        passed = bisect_right(self._up, temperature)
        if passed > self._passed_up:
            temperature = self._switch(self._passed_up, passed, temperature, latent)
        passed = bisect_left(self._down, temperature)
        if passed < self._passed_down:
            temperature = self._switch(self._passed_down - 1, passed - 1, temperature, latent)
        self._passed_up = bisect_right(self._up, temperature)
        self._passed_down = bisect_left(self._down, temperature)
        return temperature

    def _switch(self, first: int, stop: int, temperature: float, latent: float) -> float:
        """Switch domains in the order of their thresholds while what is left of the heat reaches them."""
        metal = stop > first
        sign = 1.0 if metal else -1.0
        order, thresholds = (self._order_up, self._up) if metal else (self._order_down, self._down)
        places = np.arange(first, stop, 1 if metal else -1)
        places = places[self._metal[order[places]] != metal]
        domains = order[places]
        if latent > 0.0 and places.size:
            spent = latent * np.cumsum(self._weights[0, domains])
            before = np.concatenate([[0.0], spent[:-1]])
            reached = sign * temperature - before >= sign * np.array([thresholds[place] for place in places])
            count = places.size if reached.all() else int(np.argmin(reached))
            domains = domains[:count]
            temperature -= sign * (spent[count - 1] if count else 0.0)
        self._metal[domains] = metal
        self._fractions += sign * self._weights[:, domains].sum(axis=1)
        return float(temperature)


class LimitingLoop:
    """Limiting-loop proximity (de Almeida et al., 2002): a smooth loop that remembers its last reversal.

    Semiconducting fraction g = (1 + tanh beta (s w/2 + Tc - T - Tpr P(x)))/2, x = (T - Tr)/Tpr, s the
    direction, P(x) = (1 - sin gamma x)(1 + tanh(pi^2 - 2 pi x))/2; Tpr makes g continuous at the reversal.
    """

    def __init__(self, centre: float, width: float, beta: float, gamma: float, start: float) -> None:
        self._centre, self._width, self._beta, self._gamma = centre, width, beta, gamma
        self._direction, self._temperature = 1.0, start
        self._reversal, self._proximity = start, 0.0

    def metallic(self, temperature: float) -> float:
        """Metallic fraction [1] if the film now went to `temperature` [°C]."""
        forward = (temperature - self._temperature) * self._direction >= -1e-9
        direction = self._direction if forward else -self._direction
        reversal, proximity = (self._reversal, self._proximity) if forward else self._turned()
        shift = 0.0
        if abs(proximity) > 1e-9:
            x = (temperature - reversal) / proximity
            shift = proximity * 0.5 * (1.0 - sin(self._gamma * x)) * (1.0 + tanh(pi * pi - 2.0 * pi * x))
        argument = direction * self._width / 2.0 + self._centre - temperature - shift
        return 0.5 * (1.0 - tanh(self._beta * argument))

    def commit(self, temperature: float) -> None:
        """Go to `temperature` [°C]."""
        if (temperature - self._temperature) * self._direction < -1e-9:
            self._reversal, self._proximity = self._turned()
            self._direction = -self._direction
        self._temperature = temperature

    def _turned(self) -> tuple[float, float]:
        """Reversal temperature [°C] and proximity Tpr [K] of a loop that turns round where it is."""
        metallic = min(max(self.metallic(self._temperature), 1e-9), 1.0 - 1e-9)
        limit = -self._direction * self._width / 2.0 + self._centre
        return self._temperature, limit - atanh(1.0 - 2.0 * metallic) / self._beta - self._temperature


class SmoothLoop:
    """Two limiting loops, the electrical and the structural transition, at one temperature."""

    def __init__(self, electrical: LimitingLoop, structural: LimitingLoop, start: float) -> None:
        self._loops = (electrical, structural)
        self.fractions = (electrical.metallic(start), structural.metallic(start))

    def move(self, temperature: float, latent: float = 0.0) -> float:
        """Go to `temperature` [°C], less what the transition takes of it (T + latent m = constant)."""
        electrical = self._loops[0]
        if latent > 0.0:
            total = temperature + latent * self.fractions[0]
            low, high = total - latent, total
            for _ in range(40):
                temperature = 0.5 * (low + high)
                if temperature + latent * electrical.metallic(temperature) > total:
                    high = temperature
                else:
                    low = temperature
        fractions = electrical.metallic(temperature), self._loops[1].metallic(temperature)
        for loop in self._loops:
            loop.commit(temperature)
        self.fractions = fractions
        return temperature
