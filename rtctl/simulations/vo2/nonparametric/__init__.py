"""Nonparametric alternatives in the form of mechanisms: what they explain better than any cause has another cause."""

from rtctl.simulations.vo2.mechanism import Vo2Mechanism
from rtctl.simulations.vo2.nonparametric import heat_balance

UNNAMED: dict[str, Vo2Mechanism] = {module.MECHANISM.id: module.MECHANISM for module in (heat_balance,)}
