/** The fields of the live page: made once for a run, then told the values, which never replace what is being typed. */

import { figure, words } from "./colours.js";

const NAMES = { setpoint: "set-point" };

/** An input that shows a value until somebody types another one. */
class Value {
  constructor(id) {
    this.input = document.createElement("input");
    this.input.inputMode = "decimal";
    this.input.id = id;
    this.shown = "";
  }

  /** Show a value, in place of the one before but not in place of what was typed. */
  show(value) {
    const typed = this.input.value !== this.shown;
    this.shown = value === null ? "" : figure(value);
    if (!typed) this.input.value = this.shown;
  }

  /** Show a value also in place of what was typed. */
  replace(value) {
    this.shown = this.input.value;
    this.show(value);
  }

  /** Send what stands in the field; once it was taken, what the run made of it may be shown. */
  async send(name, send) {
    const sent = this.input.value;
    if (await send(name, sent)) this.shown = sent;
  }

  onEnter(press) {
    this.input.onkeydown = (event) => {
      if (event.key === "Enter") press();
    };
  }
}

/** One parameter with a line of its own; `send(name, text)` returns whether the change was taken. */
export class Parameter {
  constructor({ name, unit }, send) {
    const value = new Value(`field-${name}`);
    const label = document.createElement("label");
    label.textContent = NAMES[name] ?? words(name.replace("controller.", ""));
    label.htmlFor = value.input.id;
    const press = () => value.send(name, send);
    value.onEnter(press);
    this.value = value;
    this.name = name;
    this.elements = [label, value.input, dim(unit), button("Set", press)];
    if (name === "setpoint") this.elements.push(together(this.elements.pop(), plan(() => send(name, "plan"))));
  }

  show(all) {
    this.value.show(all.find(({ name }) => name === this.name).value);
  }
}

/** One line to choose a name of a group and to give it a value. */
export class Group {
  constructor({ prefix, title, press, shows }, members, send) {
    this.prefix = prefix;
    this.shows = shows;
    const heading = dim(title);
    heading.classList.add("wide");
    this.select = document.createElement("select");
    this.select.id = `choose-${prefix}`;
    this.select.setAttribute("aria-label", title);
    this.select.replaceChildren(...members.map(({ name }) => new Option("", name)));
    this.select.onchange = () => this.#choose();
    this.value = new Value(`value-${prefix}`);
    this.unit = dim("");
    const set = () => this.value.send(this.select.value, send);
    this.value.onEnter(set);
    this.elements = [heading, this.select, this.value.input, this.unit, button(press, set)];
    this.show(members);
    this.#choose();
  }

  show(all) {
    this.members = all.filter(({ name }) => name.startsWith(this.prefix));
    this.members.forEach((one, k) => (this.select.options[k].text = this.#words(one)));
    this.value.show(this.#chosen().value);
  }

  #choose() {
    this.value.replace(this.#chosen().value);
    this.unit.textContent = this.#chosen().unit;
  }

  #chosen() {
    return this.members.find(({ name }) => name === this.select.value);
  }

  #words({ name, unit, value }) {
    const own = words(name.slice(this.prefix.length).replaceAll(".", " "));
    return this.shows && value ? `${own} (${figure(value)} ${unit})` : own;
  }
}

function plan(press) {
  const made = button("Plan", press);
  made.title = "The set-points of the scenario again";
  return made;
}

function together(...elements) {
  const made = document.createElement("span");
  made.className = "together";
  made.append(elements[0], " ", ...elements.slice(1));
  return made;
}

function dim(text) {
  const made = document.createElement("span");
  made.className = "dim";
  made.textContent = text;
  return made;
}

function button(text, press) {
  const made = document.createElement("button");
  made.type = "button"; // else Enter in any field would press the first one
  made.textContent = text;
  made.onclick = press;
  return made;
}
