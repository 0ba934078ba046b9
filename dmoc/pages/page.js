"use strict";

const shown = JSON.parse(document.getElementById("data").textContent);
const slider = document.getElementById("slider");
const times = shown.times;
// The panels over time have these margins [pixels], so that the cursor stands at the same place in all.
const MARGIN = { l: 58, r: 14, t: 6, b: 26 };
// A flight is shown in so many milliseconds.
const FLIGHT = 9000;
// Colours that are too dark before a dark page, and what stands for them there.
const LIGHTER = {
  "#0072b2": "#4aa8e0", "#d55e00": "#f58a42", "#009e73": "#35c79c", "#808080": "#99a1aa", "#cc79a7": "#dd92ba",
};
const CONFIG = { displayModeBar: false, responsive: true, scrollZoom: false, doubleClick: false };

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const isDark = () => document.documentElement.dataset.theme === "dark" || matchMedia("(prefers-color-scheme: dark)").matches;

/** A copy of what Python drew, in the colours of the page. */
function themed(value) {
  if (Array.isArray(value)) return value.length && typeof value[0] === "number" ? value : value.map(themed);
  if (value && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, themed(part)]));
  }
  if (value === "ink") return colour("ink");
  if (value === "page") return colour("card");
  return (isDark() && LIGHTER[value]) || value;
}

/** A number with four digits; one that is nothing beside `most` is told as zero. */
function told(value, most = 0) {
  const known = most && Math.abs(value) < 1e-6 * most ? 0 : value;
  return String(Number(known.toPrecision(4))).replaceAll("-", "\u2212");
}

/** The value of a curve at a time; null before its begin and behind its end. */
function valueAt({ x, y, steps }, t) {
  const last = x.length - 1, spare = 1e-6 * (times[times.length - 1] - times[0]);
  if (t < x[0] - spare || t > x[last] + spare) return null;
  let low = 0, high = last;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (x[middle] <= t) low = middle; else high = middle - 1;
  }
  if (low === last || steps || y[low] === null || y[low + 1] === null) return y[low];
  return y[low] + ((t - x[low]) / (x[low + 1] - x[low] || 1)) * (y[low + 1] - y[low]);
}

const SYMBOLS = {
  "circle-open": '<circle cx="11" cy="4.5" r="3.4" fill="none" stroke-width="1.4"/>', diamond: '<path d="M11 0l4.5 4.5-4.5 4.5-4.5-4.5z"/>',
  "diamond-open": '<path d="M11 .8l3.7 3.7-3.7 3.7-3.7-3.7z" fill="none" stroke-width="1.3"/>', star: '<path d="M11 0l1.3 3h3.2l-2.6 2 1 3.2L11 6.3 8.1 8.2l1-3.2-2.6-2h3.2z"/>',
};

function swatch({ colour: of, gap, dash, fill, symbol = "" }) {
  if (symbol in SYMBOLS) return `<svg viewBox="0 0 22 9" fill="${themed(of)}" stroke="${themed(of)}" stroke-width="0">${SYMBOLS[symbol]}</svg>`;
  const line = { solid: "none", dash: "6 3", dot: "2 2", dashdot: "6 2 2 2" }[dash] ?? "none";
  const dots = dash === "none" && !fill;
  const mark = dots
    ? `<circle cx="11" cy="4.5" r="3.5" fill="${themed(of)}"/>`
    : (gap ? `<path d="M0 4.5H22" stroke="${themed(gap)}" stroke-width="2.5"/>` : "") +
      `<path d="M0 4.5H22" stroke="${themed(of)}" stroke-width="${fill ? 8 : 2.5}" stroke-dasharray="${line}"/>`;
  return `<svg viewBox="0 0 22 9">${mark}</svg>`;
}

const base = () => ({
  paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", showlegend: false, hovermode: false,
  font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colour("soft") }, uirevision: "same",
});
const axis = () => ({ exponentformat: "power", gridcolor: colour("grid"), zerolinecolor: colour("edge"), linecolor: colour("edge"), nticks: 6 });

function tracesOf(curves) {
  return curves.flatMap((curve) => {
    const look = { type: "scatter", name: curve.name, x: curve.x, y: curve.y, hoverinfo: "skip", opacity: curve.faint ?? 1 };
    if (curve.fill) return [{ ...look, mode: "lines", fill: "toself", fillcolor: themed(curve.colour), line: { width: 0 } }];
    const line = { color: themed(curve.colour), width: curve.width ?? 1.8, dash: curve.dash, shape: curve.steps ? "hv" : "linear" };
    const mode = curve.dash === "none" ? "markers" : curve.marker ? "lines+markers" : "lines";
    const drawn = { ...look, mode, line: curve.dash === "none" ? {} : line, marker: { color: line.color, size: 9, symbol: curve.symbol } };
    return curve.gap ? [{ ...drawn, line: { ...line, dash: "solid", color: themed(curve.gap) } }, drawn] : [drawn];
  });
}

/** A panel over time: its head with the values at the time that is shown, its chart, and the cursor. */
class Lane {
  constructor(panel, place, height) {
    this.panel = panel;
    this.box = document.createElement("div");
    this.box.className = "panel";
    const unit = /\[(.*)\]/.exec(panel.label);
    this.box.innerHTML = `<h2>${panel.title} <small>${unit ? unit[1] : panel.label}</small></h2>` +
      `<div class="legend"></div><div class="plot"><div class="chart" style="height:100%"></div><div class="cursor"></div></div>`;
    place.append(this.box);
    [this.legend, this.plot] = this.box.querySelectorAll(".legend, .plot");
    [this.chart, this.cursor] = this.plot.children;
    if (height) this.plot.style.height = height;
    this.span = [times[0], times[times.length - 1]];
    const spare = 0.01 * (this.span[1] - this.span[0]);
    this.whole = [this.span[0] - spare, this.span[1] + spare];
    this.range = this.whole;
    this.plot.addEventListener("pointermove", (event) => {
      if (event.buttons || playing || event.pointerType === "touch") return;
      const inside = this.plot.clientWidth - MARGIN.l - MARGIN.r;
      const part = (event.clientX - this.plot.getBoundingClientRect().left - MARGIN.l) / inside;
      if (part >= 0 && part <= 1) showTime(this.range[0] + part * (this.range[1] - this.range[0]));
    });
  }

  draw() {
    const { panel } = this;
    const shapes = [
      ...panel.bands.map(([x0, x1]) => ({ type: "rect", layer: "below", yref: "paper", y0: 0, y1: 1, x0, x1, fillcolor: "#e69f00", opacity: isDark() ? 0.22 : 0.16, line: { width: 0 } })),
      ...panel.marks.map((x) => ({ type: "line", layer: "below", yref: "paper", y0: 0, y1: 1, x0: x, x1: x, line: { color: colour("soft"), width: 1, dash: "dot" } })),
      ...panel.fixed.filter(({ y }) => y !== null).map(({ y, colour: of }) => ({ type: "line", layer: "below", xref: "paper", x0: 0, x1: 1, y0: y, y1: y, line: { color: themed(of), width: 1.3, dash: "dash" } })),
    ];
    const layout = {
      ...base(), margin: MARGIN, shapes, dragmode: "zoom",
      xaxis: { ...axis(), range: [...this.range], zeroline: false }, yaxis: { ...axis(), range: panel.range, fixedrange: true, nticks: 5 },
    };
    Plotly.react(this.chart, tracesOf(panel.curves), layout, CONFIG);
    this.chart.removeAllListeners?.("plotly_relayout");
    this.chart.on("plotly_relayout", (change) => {
      if (change["xaxis.range[0]"] !== undefined) zoom([change["xaxis.range[0]"], change["xaxis.range[1]"]], this);
    });
    this.chart.ondblclick = () => zoom(null);
    this.groups = new Map();
    for (const curve of panel.curves) {
      if (!this.groups.has(curve.name)) this.groups.set(curve.name, []);
      this.groups.get(curve.name).push(curve);
    }
    const heads = [...this.groups].map(([name, [first]]) => {
      return `<span>${name ? swatch(first) : ""}${name} <b></b></span>`;
    });
    const fixed = new Map();
    for (const { name, y, colour: of } of panel.fixed.filter(({ name: n }) => n)) {
      fixed.set(name, [...(fixed.get(name) ?? []), { y, of }]);
    }
    for (const [name, levels] of fixed) {
      const values = levels.map(({ y }) => y).filter((y) => y !== null);
      const both = values.length === 2 && values[0] === -values[1];
      const words = both ? `\u00b1${told(Math.abs(values[1]))}` : values.map(told).join(", ");
      heads.push(`<span>${swatch({ colour: levels[0].of, dash: "dash" })}${name} ${words}</span>`);
    }
    if (panel.bands.length) heads.push(`<span>${swatch({ colour: "#e69f00", fill: true })}engine on</span>`);
    this.legend.innerHTML = heads.join("");
    this.values = this.legend.querySelectorAll("b");
    this.show(now());
  }

  show(t) {
    const part = (t - this.range[0]) / (this.range[1] - this.range[0]);
    const inside = this.plot.clientWidth - MARGIN.l - MARGIN.r;
    this.cursor.style.left = `${MARGIN.l + part * inside}px`;
    this.cursor.hidden = part < 0 || part > 1;
    [...this.groups.values()].forEach((curves, i) => {
      // Behind a joint the value is that of the next leg.
      const known = curves.filter(({ fill, dash }) => !fill && dash !== "none").map((curve) => valueAt(curve, t)).filter((value) => value !== null);
      const value = known[known.length - 1], one = curves[0].name || known.length === 1;
      this.values[i].textContent = known.length && one ? told(value, Math.abs(this.panel.range[1])) : "";
      if (known.length && this.dots) this.moveDot(i, part * inside, value);
    });
  }
}

/** The chart of a place over time, in which bodies are dots. */
class Line extends Lane {
  dots = new Map();

  moveDot(i, across, value) {
    if (!this.dots.has(i)) {
      const dot = document.createElement("div");
      dot.className = "dot";
      this.plot.append(dot);
      this.dots.set(i, dot);
    }
    const [low, high] = this.panel.range, dot = this.dots.get(i);
    const up = (value - low) / (high - low), inside = this.plot.clientHeight - MARGIN.t - MARGIN.b;
    dot.style.left = `${MARGIN.l + across}px`;
    dot.style.top = `${MARGIN.t + (1 - up) * inside}px`;
    dot.style.background = themed([...this.groups.values()][i][0].colour);
  }
}

/** All panels show the same stretch of time; all of it after a double click. */
function zoom(range, from) {
  for (const lane of lanes) {
    const wanted = range ?? lane.whole;
    lane.range = wanted;
    if (lane !== from) Plotly.relayout(lane.chart, { "xaxis.range": [...wanted] });
  }
  showFrame(Number(slider.value));
}

const stage = {
  place: document.getElementById("stage"),

  layout() {
    const { axes, view, shape, unit, flat } = shown.stage;
    const label = (name) => ({ text: unit ? `${name} [${unit}]` : name });
    if (axes === 2) {
      return {
        ...base(), margin: { l: 58, r: 10, t: 10, b: 42 }, hovermode: "closest", dragmode: "pan",
        xaxis: { ...axis(), range: view[0], title: label("x"), zeroline: false },
        yaxis: { ...axis(), range: view[1], title: label("y"), zeroline: false, scaleanchor: "x" },
      };
    }
    // On a narrow screen the letters take more of the room, so that the box is seen from further away.
    const far = this.place.clientWidth < 500 ? 2.2 : 1.75;
    const grow = 1.4 / Math.hypot(...shape), rise = (flat ? 48 : 24) * Math.PI / 180, side = -Math.PI / 3;
    const eye = { x: far * Math.cos(rise) * Math.cos(side), y: far * Math.cos(rise) * Math.sin(side), z: far * Math.sin(rise) };
    const wall = (name, i) => ({ ...axis(), gridcolor: colour("edge"), range: view[i], title: label(name), showbackground: false, showspikes: false, nticks: 2 + Math.round(4 * shape[i]) });
    return {
      ...base(), margin: { l: 0, r: 0, t: 0, b: 0 }, hovermode: "closest",
      scene: {
        xaxis: wall("x", 0), yaxis: wall("y", 1), zaxis: wall("z", 2), aspectmode: "manual", dragmode: "orbit",
        aspectratio: { x: grow * shape[0], y: grow * shape[1], z: grow * shape[2] },
        camera: { eye, center: { x: 0, y: 0, z: -0.06 } },
      },
    };
  },

  draw() {
    const { still, moving } = shown.stage;
    const traces = themed([...still, ...moving.map(({ frames, ...trace }) => trace)]);
    Plotly.react(this.place, traces, this.layout(), { ...CONFIG, scrollZoom: true, doubleClick: "reset" });
    this.moving = moving.map((_, i) => still.length + i);
    const heads = new Map();
    for (const trace of [...still, ...moving]) {
      if (!trace.name || heads.has(trace.name)) continue;
      heads.set(trace.name, `<span>${stage.mark(trace)}${trace.name}${stage.scale(trace)}</span>`);
    }
    document.getElementById("stage-legend").innerHTML = [...heads.values()].join("");
    this.show(Number(slider.value));
  },

  mark(trace) {
    const scaled = (trace.line ?? trace.marker)?.colorscale ?? trace.marker?.colorscale;
    if (scaled && trace.type !== "surface") {
      const stops = scaled.map(([at, of]) => `<stop offset="${at}" stop-color="${themed(of)}"/>`).join("");
      return `<svg viewBox="0 0 22 9"><defs><linearGradient id="force">${stops}</linearGradient></defs><rect y="2" width="22" height="5" rx="2" fill="url(#force)"/></svg>`;
    }
    if (trace.type === "mesh3d") return swatch({ colour: trace.color, fill: true });
    if (trace.type === "surface") return swatch({ colour: trace.colorscale[0][1], fill: true });
    if (trace.fill) return swatch({ colour: trace.fillcolor, fill: true });
    if (trace.mode === "markers") return swatch({ colour: trace.marker.color, dash: "none", symbol: trace.marker.symbol });
    return swatch({ colour: trace.line.color, dash: trace.line.dash ?? "solid" });
  },

  scale(trace) {
    const most = (trace.line?.colorscale ? trace.line : trace.marker)?.cmax;
    return trace.unit && most ? `, by its force: 0 to ${told(most)} ${trace.unit}` : "";
  },

  show(frame) {
    const { moving, axes, unit } = shown.stage;
    const update = {};
    ["x", "y", "z"].slice(0, axes).forEach((name, i) => {
      update[name] = moving.map(({ frames }) => frames[Math.min(frame, frames.length - 1)].map((point) => point[i]));
    });
    if (moving.length) Plotly.restyle(this.place, update, this.moving);
    const reach = Math.max(...shown.stage.view.flat().map(Math.abs));
    const bodies = moving.filter(({ mode }) => mode === "markers");
    const words = bodies.slice(0, 4).map(({ name, frames }) => {
      const [place] = frames[frame];
      return `${bodies.length > 1 ? name : "at"} (${place.map((value) => told(value, reach)).join(", ")})`;
    });
    document.getElementById("place").innerHTML = words.length && unit ? `${words.join("   ")} ${unit}` : "";
  },
};

let lanes = [], playing = 0;
const now = () => times[Number(slider.value)];

function showFrame(frame) {
  slider.value = frame;
  const t = times[frame];
  document.getElementById("clock").textContent = `${told(t)} ${shown.time}`;
  if (shown.stage) stage.show(frame);
  for (const lane of lanes) lane.show(t);
}

function showTime(t) {
  const part = (t - times[0]) / (times[times.length - 1] - times[0]);
  showFrame(Math.round(Math.min(Math.max(part, 0), 1) * (times.length - 1)));
}

function fly() {
  const button = document.getElementById("play");
  if (playing) {
    cancelAnimationFrame(playing);
    playing = 0;
    button.textContent = "\u25b6";
    return;
  }
  const last = times.length - 1, first = Number(slider.value) % last;
  const begun = performance.now() - (first / last) * FLIGHT;
  button.textContent = "\u275a\u275a";
  const step = (time) => {
    const frame = Math.min(Math.floor(((time - begun) / FLIGHT) * last), last);
    if (frame >= 0 && frame !== Number(slider.value)) showFrame(frame);
    if (frame < last) playing = requestAnimationFrame(step); else { playing = 1; fly(); }
  };
  playing = requestAnimationFrame(step);
}

function drawCost() {
  const place = document.getElementById("cost");
  if (!place || !shown.cost) return;
  place.innerHTML = '<div class="plot"></div>';
  const { curves, range, reach, label, below } = shown.cost;
  const layout = {
    ...base(), margin: { l: 66, r: 14, t: 6, b: 42 }, showlegend: true,
    xaxis: { ...axis(), type: "log", title: { text: below }, range: reach.map(Math.log10) },
    yaxis: { ...axis(), type: "log", title: { text: "relative error" }, range: range.map(Math.log10), exponentformat: "power" },
  };
  Plotly.newPlot(place.firstChild, tracesOf(curves), layout, CONFIG);
}

function draw() {
  if (shown.stage) stage.draw();
  for (const lane of lanes) lane.draw();
  drawCost();
}

async function begin() {
  const packed = document.getElementById("plotly");
  // An address that holds its data itself: nothing is asked of a network.
  const { body } = await fetch("data:application/gzip;base64," + packed.textContent);
  const script = document.createElement("script");
  script.textContent = await new Response(body.pipeThrough(new DecompressionStream("gzip"))).text();
  document.head.append(script);
  packed.remove();
  slider.max = times.length - 1;
  const place = document.getElementById("lanes");
  lanes = shown.panels.map((panel) => new Lane(panel, place));
  if (shown.line) {
    const line = new Line(shown.line, stage.place, "min(52vh, 460px)");
    lanes.push(line);
    stage.place.style.height = "auto";
  }
  const hint = document.createElement("p");
  hint.className = "hint";
  hint.textContent = `time in ${shown.time}; hover to look there, drag to zoom, double click for all`;
  place.append(hint);
  draw();
  showFrame(0);
  slider.addEventListener("input", () => showFrame(Number(slider.value)));
  document.getElementById("play").addEventListener("click", fly);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  addEventListener("resize", () => showFrame(Number(slider.value)));
  document.documentElement.dataset.ready = "yes";
}

begin();
