/** Changes of the run: set-point and gains by fields, stop by one press. */

import { figure, words } from "./colours.js";

const NAMES = { setpoint: "set-point" };

export class Control {
  /** @param {Function} run returns the name of the run that is shown */
  constructor(run) {
    this.run = run;
    this.allowed = document.body.dataset.mayChange === "yes";
    const stop = document.getElementById("stop");
    stop.hidden = !this.allowed;
    stop.onclick = () => this.#send("stop");
    document.getElementById("control").onsubmit = (event) => event.preventDefault();
  }

  /** Show the fields while a run is under way. */
  async follow(recording) {
    document.getElementById("stop").disabled = !recording;
    document.getElementById("control").hidden = !this.allowed || !recording;
    if (this.allowed && recording) await this.#ask();
  }

  async #ask() {
    const response = await fetch(`parameters?${new URLSearchParams({ run: this.run() })}`);
    if (!response.ok) {
      this.#say(await response.text(), true);
      return;
    }
    this.#say("", false);
    const fields = (await response.json()).flatMap((one) => this.#field(one));
    document.getElementById("parameters").replaceChildren(...fields);
  }

  #field({ name, unit, value }) {
    const label = document.createElement("label");
    label.textContent = NAMES[name] ?? words(name.replace("controller.", ""));
    const input = document.createElement("input");
    input.inputMode = "decimal";
    input.id = `field-${name}`;
    label.htmlFor = input.id;
    input.value = value === null ? "" : figure(value);
    const said = document.createElement("span");
    said.className = "dim";
    said.textContent = unit;
    const set = button("Set", () => this.#send(name, input.value));
    input.onkeydown = (event) => {
      if (event.key === "Enter") this.#send(name, input.value);
    };
    if (name !== "setpoint") return [label, input, said, set];
    const plan = button("Plan", () => this.#send(name, "plan"));
    plan.title = "The set-points of the scenario again";
    const both = document.createElement("span");
    both.className = "together";
    both.append(set, " ", plan);
    return [label, input, said, both];
  }

  async #send(name, value = "") {
    try {
      const body = JSON.stringify({ run: this.run(), name, value: value.trim() });
      const response = await fetch("control", { method: "POST", headers: { "Content-Type": "application/json" }, body });
      if (response.ok) this.#say((await response.json()).said, false);
      else this.#say(await response.text(), true);
    } catch {
      this.#say("the server of this page does not answer: nothing was changed", true);
    }
  }

  #say(text, refused) {
    const said = document.getElementById("said");
    said.textContent = text;
    said.className = refused ? "refused" : "dim";
    const message = document.getElementById("message");
    message.hidden = !refused;
    message.textContent = text;
  }
}

function button(text, press) {
  const made = document.createElement("button");
  made.type = "button"; // else Enter in any field would press the first one
  made.textContent = text;
  made.onclick = press;
  return made;
}
