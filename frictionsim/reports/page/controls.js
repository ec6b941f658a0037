"use strict";
// What sets the clock: buttons, a slider, keys, and the rows of the events.

frictionsim.Controls = class {
  constructor(container, clock) {
    this.clock = clock;
    const { button, element } = frictionsim;
    this.playButton = button("", "", () => clock.toggle());
    this.slider = element("input", {
      type: "range", min: clock.start, max: clock.end, step: "any", id: "time", "aria-label": "Time",
      oninput: () => { clock.pause(); clock.set(Number(this.slider.value)); },
    });
    this.shown = element("output", { for: "time" });
    this.speed = element("select", { id: "speed", onchange: () => clock.setSpeed(Number(this.speed.value)) });
    for (const speed of clock.speeds) this.speed.append(element("option", { value: speed }, `${speed}\u00d7`));
    const buttons = element("div", { class: "buttons", role: "group", "aria-label": "Clock" },
      button("|\u2039", "To the start", () => this.jump(clock.start)),
      ...this.ofEvents("\u00ab", "To the event before", -1),
      button("\u2039", "One sample back", () => clock.step(-1)),
      this.playButton,
      button("\u203a", "One sample forward", () => clock.step(1)),
      ...this.ofEvents("\u00bb", "To the next event", 1),
      button("\u203a|", "To the end", () => this.jump(clock.end)),
      element("label", {}, "Speed ", this.speed),
      button("?", "Keys", () => this.help.showModal()));
    this.help = frictionsim.keyHelp();
    container.append(element("div", { class: "time" }, this.slider, this.shown), buttons, this.help);
    if (!(clock.end > clock.start)) container.querySelectorAll("button, input").forEach((e) => { e.disabled = true; });
    clock.follow((time) => this.show(time));
    clock.followState(() => this.showState());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  ofEvents(label, title, direction) {
    return this.clock.events.length ? [frictionsim.button(label, title, () => this.clock.stepEvent(direction))] : [];
  }

  jump(time) {
    this.clock.pause();
    this.clock.set(time);
  }

  show(time) {
    this.slider.value = time;
    const text = `${frictionsim.timeText(time, this.clock)} s`;
    this.slider.setAttribute("aria-valuetext", text);
    this.shown.textContent = `${text} of ${frictionsim.number(this.clock.end)} s`;
  }

  showState() {
    const { playing, speed } = this.clock;
    this.playButton.textContent = playing ? "\u275a\u275a" : "\u25b6";
    this.playButton.title = playing ? "Pause" : "Play";
    this.playButton.setAttribute("aria-label", this.playButton.title);
    this.speed.value = speed;
  }

  key(event) {
    const action = frictionsim.KEYS.find(({ key, shift = false }) => key.includes(event.key) && shift === (event.shiftKey && event.key.length > 1));
    if (!action || event.ctrlKey || event.altKey || event.metaKey || this.help.open) return;
    // What takes a key itself keeps it: a button the space, a choice the arrows, a text its scrolling.
    const taken = event.key === " " ? "button, summary, a, select" : "select, pre, .scrolled";
    if (event.target.closest?.(taken)) return;
    event.preventDefault();
    action.act(this.clock, this);
  }
};

// As many digits as a step needs to be seen.
frictionsim.timeText = (time, clock) => {
  const digits = Math.ceil(-Math.log10((clock.end - clock.start) / 1000));
  return time.toFixed(Math.min(Math.max(Number.isFinite(digits) ? digits : 3, 0), 12));
};

frictionsim.KEYS = [
  { key: [" "], words: "play or pause", shown: "Space", act: (clock) => clock.toggle() },
  { key: ["ArrowLeft"], words: "one sample back", shown: "\u2190", act: (clock) => clock.step(-1) },
  { key: ["ArrowRight"], words: "one sample forward", shown: "\u2192", act: (clock) => clock.step(1) },
  { key: ["ArrowLeft"], shift: true, words: "to the event before", shown: "Shift \u2190", act: (clock) => clock.stepEvent(-1) },
  { key: ["ArrowRight"], shift: true, words: "to the next event", shown: "Shift \u2192", act: (clock) => clock.stepEvent(1) },
  { key: ["Home"], words: "to the start", shown: "Home", act: (clock, controls) => controls.jump(clock.start) },
  { key: ["End"], words: "to the end", shown: "End", act: (clock, controls) => controls.jump(clock.end) },
  { key: ["+", "="], words: "faster", shown: "+", act: (clock) => clock.faster(1) },
  { key: ["-"], words: "slower", shown: "\u2212", act: (clock) => clock.faster(-1) },
  { key: ["?"], words: "these keys", shown: "?", act: (clock, controls) => controls.help.showModal() },
];

frictionsim.keyHelp = () => {
  const { element } = frictionsim;
  const rows = frictionsim.KEYS.map(({ shown, words }) =>
    element("tr", {}, element("th", { scope: "row" }, element("kbd", {}, shown)), element("td", {}, words)));
  const dialog = element("dialog", { id: "keys", "aria-label": "Keys" },
    element("table", {}, element("caption", {}, "Keys"), element("tbody", {}, ...rows)));
  dialog.append(frictionsim.element("button", { type: "button", onclick: () => dialog.close() }, "Close"));
  return dialog;
};

// The rows of the table of events: a button sets the clock, the last event so far is marked.
frictionsim.followEvents = (clock) => {
  const buttons = [...document.querySelectorAll("#events button[data-time]")];
  const times = buttons.map((button) => Number(button.dataset.time));
  buttons.forEach((button, number) => button.addEventListener("click", () => { clock.pause(); clock.set(times[number]); }));
  let marked = -1;
  clock.follow((time) => {
    const now = frictionsim.lastUpTo(times, time);
    if (now === marked) return;
    buttons[marked]?.closest("tr").removeAttribute("aria-current");
    buttons[now]?.closest("tr").setAttribute("aria-current", "true");
    marked = now;
  });
};
