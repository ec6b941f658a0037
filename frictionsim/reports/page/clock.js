"use strict";
// The time that charts, drawings and tables of a page show.

frictionsim.Clock = class {
  constructor(start, end) {
    [this.start, this.end, this.time, this.speed] = [start, end, start, 1];
    this.playing = false;
    this.followers = [];
  }

  follow(follower) {
    this.followers.push(follower);
    follower(this.time);
  }

  set(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    for (const follower of this.followers) follower(this.time);
  }
};
