/** Changes of the run: set-point and gains by fields, stop by one press. */

import { Group, Parameter } from "./fields.js";

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
    this.made = ""; // the run and the names that the fields were made for
    this.fields = [];
    this.allowed = document.body.dataset.mayChange === "yes";
    const stop = document.getElementById("stop");
    stop.hidden = !this.allowed;
    stop.onclick = () => this.#send("stop");
    document.getElementById("control").onsubmit = (event) => event.preventDefault();
  }

  /** Show the fields while a run is under way. */
  async follow(recording) {
    document.getElementById("stop").disabled = !recording;
    const box = document.getElementById("control");
    box.hidden = !this.allowed || !recording;
    if (!this.allowed || !recording || !(await this.#ask())) return;
    this.#say("", false);
    box.hidden = this.fields.length === 0; // an excitation can only be stopped
  }

  /** Show the values that the run has now; the fields stay, and so does what is being typed in them. */
  async #ask() {
    const run = this.run();
    const response = await fetch(`parameters?${new URLSearchParams({ run })}`);
    if (!response.ok) {
      this.#say(await response.text(), true);
      return false;
    }
    const all = await response.json();
    const wanted = JSON.stringify([run, ...all.map(({ name }) => name)]);
    if (wanted !== this.made) this.#make(all);
    this.made = wanted;
    for (const field of this.fields) field.show(all);
    return true;
  }

  #make(all) {
    const send = (name, text) => this.#send(name, text);
    const sendAndAsk = async (name, text) => {
      const taken = await this.#send(name, text);
      if (taken) setTimeout(() => this.#ask(), ASK_AFTER_MS);
      return taken;
    };
    const grouped = ({ name }) => GROUPS.some(({ prefix }) => name.startsWith(prefix));
    this.fields = all.filter((one) => !grouped(one)).map((one) => new Parameter(one, send));
    for (const group of GROUPS) {
      const members = all.filter(({ name }) => name.startsWith(group.prefix));
      if (members.length > 0) this.fields.push(new Group(group, members, sendAndAsk));
    }
    document.getElementById("parameters").replaceChildren(...this.fields.flatMap((field) => field.elements));
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
