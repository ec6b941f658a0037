"use strict";
// Light or dark: as the system says, until the button is pressed.

frictionsim.Theme = class {
  constructor() {
    this.followers = [];
    const system = matchMedia("(prefers-color-scheme: dark)");
    this.dark = system.matches;
    system.addEventListener("change", (event) => this.set(event.matches));
    // Paper is light; charts are drawn in colours of the page.
    addEventListener("beforeprint", () => { this.screen = this.dark; this.set(false); });
    addEventListener("afterprint", () => this.set(this.screen));
  }

  follow(follower) {
    this.followers.push(follower);
    follower(this.dark);
  }

  set(dark) {
    this.dark = dark;
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    for (const follower of this.followers) follower(dark);
  }

  button() {
    const found = frictionsim.button("", "", () => this.set(!this.dark));
    found.id = "theme";
    found.removeAttribute("aria-label");
    this.follow((dark) => {
      found.textContent = dark ? "\u2600 Light" : "\u263e Dark";
      found.title = dark ? "Show the page in light colours" : "Show the page in dark colours";
    });
    return found;
  }
};
