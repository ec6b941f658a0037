"use strict";
// A chart of Plotly, whose functions go on after they return: they are done one after the other.
// If one began within another the chart would be drawn with ranges of neither.

frictionsim.Plot = class {
  constructor(element) {
    [this.element, this.work, this.pending] = [element, Promise.resolve(), 0];
  }

  // Does something when all that was asked for before is done.
  then(task) {
    this.pending += 1;
    this.work = this.work.then(task).finally(() => { this.pending -= 1; });
    return this.work;
  }

  // Every sample is drawn: Plotly would leave out some by their distance on the screen, which moves
  // corners and makes polygons of curves.
  draw(traces, layout) {
    const whole = traces.map((trace) => ({ ...trace, line: { ...trace.line, simplify: false } }));
    return this.then(() => Plotly.react(this.element, whole, layout, frictionsim.PLOTLY));
  }

  restyle(change, ...lines) {
    return this.then(() => Plotly.restyle(this.element, change, ...lines));
  }

  zoom(wanted) {
    return this.then(() => {
      const [low, high] = this.element.layout.xaxis.range;
      const [from, to] = wanted();
      return low === from && high === to ? null : Plotly.relayout(this.element, { "xaxis.range": [from, to] });
    });
  }

  resize() {
    return this.then(() => Plotly.Plots.resize(this.element));
  }
};

frictionsim.PLOTLY = {
  responsive: true,
  displaylogo: false,
  // Nothing else: some of Plotly's own buttons send a chart to a service in the net.
  modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d", "toImage"]],
};
