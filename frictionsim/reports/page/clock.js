"use strict";
// The time that charts, drawings and tables of a page show.

frictionsim.Clock = class {
  // From start to end in s; `steps` and `events` are the times that it goes to, increasing.
  constructor(start, end, steps = [], events = []) {
    [this.start, this.end, this.steps, this.events] = [start, end, steps, events];
    [this.time, this.speed] = [start, frictionsim.Clock.speedFor(end - start)];
    [this.playing, this.frames, this.request] = [false, 0, 0];
    this.followers = [];
    this.stateFollowers = [];
  }

  // Such that a run takes some ten seconds: a 1, 2 or 5 with zeros.
  static speedFor(duration) {
    if (!(duration > 0)) return 1;
    const wanted = duration / frictionsim.Clock.SECONDS;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const found = [1, 2, 5, 10].reduce((best, digit) =>
      (Math.abs(Math.log(digit * power / wanted)) < Math.abs(Math.log(best / wanted)) ? digit * power : best), power);
    return Number(found.toPrecision(1));
  }

  get speeds() {
    const own = frictionsim.Clock.speedFor(this.end - this.start);
    return [...new Set([...frictionsim.Clock.SPEEDS, own])].sort((a, b) => a - b);
  }

  // Followers get the time, at most once a frame.
  follow(follower) {
    this.followers.push(follower);
    follower(this.time);
  }

  // These get the clock when it starts, stops or changes its speed.
  followState(follower) {
    this.stateFollowers.push(follower);
    follower(this);
  }

  set(time) {
    if (!Number.isFinite(time)) return;
    this.time = Math.min(Math.max(time, this.start), this.end);
    if (!this.request) this.request = requestAnimationFrame((now) => this.tick(now));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.tellState();
  }

  faster(steps) {
    const speeds = this.speeds;
    const place = frictionsim.lastUpTo(speeds, this.speed) + steps;
    this.setSpeed(speeds[Math.min(Math.max(place, 0), speeds.length - 1)]);
  }

  play() {
    if (this.playing || !(this.end > this.start)) return;
    if (this.time >= this.end) this.time = this.start;
    [this.playing, this.last] = [true, null];
    this.tellState();
    this.set(this.time);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.tellState();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  // To the next sample, or the one before.
  step(direction) {
    this.goTo(this.steps, direction);
  }

  stepEvent(direction) {
    this.goTo(this.events, direction);
  }

  goTo(times, direction) {
    this.pause();
    const before = frictionsim.lastUpTo(times, this.time);
    if (direction > 0) this.set(times[before + 1] ?? this.end);
    else this.set(times[times[before] === this.time ? before - 1 : before] ?? this.start);
  }

  tick(now) {
    this.request = 0;
    if (this.playing) {
      // After a pause of the browser, as in a hidden tab, the clock goes on where it was.
      const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, frictionsim.Clock.MAX_PASSED);
      this.last = now;
      this.time = Math.min(this.time + passed * this.speed, this.end);
      if (this.time >= this.end) this.pause();
    }
    this.frames += 1;
    for (const follower of this.followers) follower(this.time);
    if (this.playing && !this.request) this.request = requestAnimationFrame((then) => this.tick(then));
  }

  tellState() {
    for (const follower of this.stateFollowers) follower(this);
  }
};
frictionsim.Clock.SECONDS = 10;
frictionsim.Clock.SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
frictionsim.Clock.MAX_PASSED = 0.25;

// Plays for some seconds; the promise is of the frames in a second that the page showed.
frictionsim.frameRate = async (seconds = 2) => {
  const { clock } = frictionsim;
  clock.set(clock.start);
  clock.setSpeed((clock.end - clock.start) / (2 * seconds));
  clock.play();
  await new Promise(requestAnimationFrame);
  const [frames, begin] = [clock.frames, performance.now()];
  await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
  clock.pause();
  return (clock.frames - frames) / ((performance.now() - begin) / 1000);
};
