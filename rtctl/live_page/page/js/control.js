/** Changes of the run: set-point and gains by fields, stop by one press. */

import { figure, words } from "./colours.js";

const NAMES = { setpoint: "set-point" };
const GROUPS = [
  { prefix: "effects.", title: "Hidden effects of the device", press: "Set", shows: true },
  { prefix: "parameters.", title: "Parameters of the device", press: "Set", shows: true },
  { prefix: "fault.", title: "Faults, each once, for so long", press: "Inject", shows: false },
]; // of a served device: many names, one line each group

const ASK_AFTER_MS = 200; // by then the device has taken a change

export class Control {
  /** @param {Function} run returns the name of the run that is shown */
  constructor(run) {
    this.run = run;
    this.chosen = {}; // name shown of each group
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

  /** Show what the device has taken of a change that was made at the elements `own`. */
  #askLater(own) {
    setTimeout(() => (this.#isElsewhere(own) ? this.#askLater(own) : this.#ask(own)), ASK_AFTER_MS);
  }

  /** Whether somebody is at another field, where what is typed would be lost with it. */
  #isElsewhere(own) {
    const at = document.activeElement;
    return document.getElementById("parameters").contains(at) && !own.includes(at);
  }

  /** Make the fields anew; after a change, which was made at the elements `own`, once nobody is at others. */
  async #ask(own = null) {
    const response = await fetch(`parameters?${new URLSearchParams({ run: this.run() })}`);
    if (!response.ok) {
      this.#say(await response.text(), true);
      return;
    }
    if (!own) this.#say("", false);
    const all = await response.json();
    if (own && this.#isElsewhere(own)) {
      this.#askLater(own);
      return;
    }
    const groupOf = ({ name }) => GROUPS.find(({ prefix }) => name.startsWith(prefix));
    const fields = all.filter((one) => !groupOf(one)).flatMap((one) => this.#field(one));
    for (const group of GROUPS) fields.push(...this.#group(group, all.filter((one) => groupOf(one) === group)));
    const at = document.activeElement.id;
    document.getElementById("parameters").replaceChildren(...fields);
    document.getElementById(at)?.focus();
  }

  /** One line to choose a name of a group and to give it a value. */
  #group({ prefix, title, press, shows }, members) {
    if (members.length === 0) return [];
    const heading = document.createElement("span");
    heading.className = "dim wide";
    heading.textContent = title;
    const select = document.createElement("select");
    select.id = `choose-${prefix}`;
    select.setAttribute("aria-label", title);
    const text = ({ name, unit, value }) =>
      words(name.slice(prefix.length).replaceAll(".", " ")) + (shows && value ? ` (${figure(value)} ${unit})` : "");
    select.replaceChildren(...members.map((one) => new Option(text(one), one.name)));
    if (members.some(({ name }) => name === this.chosen[prefix])) select.value = this.chosen[prefix];
    const input = document.createElement("input");
    input.inputMode = "decimal";
    input.id = `value-${prefix}`;
    const unit = document.createElement("span");
    unit.className = "dim";
    const show = () => {
      const one = members.find(({ name }) => name === select.value);
      this.chosen[prefix] = one.name;
      input.value = figure(one.value);
      unit.textContent = one.unit;
    };
    select.onchange = show;
    show();
    const send = async () => {
      if (await this.#send(select.value, input.value)) this.#askLater([select, input, set]);
    };
    const set = button(press, send);
    input.onkeydown = (event) => {
      if (event.key === "Enter") send();
    };
    return [heading, select, input, unit, set];
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
      return response.ok;
    } catch {
      this.#say("the server of this page does not answer: nothing was changed", true);
      return false;
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
