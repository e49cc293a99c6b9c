"use strict";
// Draws the curves of a report and lets a person zoom, search, sort and open. It fetches nothing.
(() => {
  const DATA = JSON.parse(document.getElementById("data").textContent);
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const make = (tag, name, text) => {
    const made = document.createElement(tag);
    made.className = name;
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  // ---- tables: search, sort, rules by how they ended ----

  const filters = new Map();
  function refilter(id) {
    const table = document.getElementById(id);
    const { words = [], status = "" } = filters.get(id) || {};
    let shown = 0;
    const rows = all("tbody tr", table);
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      const wanted = words.every((word) => text.includes(word)) && (!status || row.dataset.status === status);
      row.hidden = !wanted;
      shown += wanted;
    }
    const said = document.querySelector(`[data-shown="${id}"]`);
    if (said) said.textContent = shown === rows.length ? "" : `${shown} of ${rows.length}`;
  }
  for (const input of all("input[data-filter]")) {
    input.addEventListener("input", () => {
      const id = input.dataset.filter;
      filters.set(id, { ...filters.get(id), words: input.value.toLowerCase().split(/\s+/).filter(Boolean) });
      refilter(id);
    });
  }
  const statuses = all("button[data-status]");
  for (const button of statuses) {
    button.addEventListener("click", () => {
      filters.set("runs", { ...filters.get("runs"), status: button.dataset.status });
      press(statuses, button);
      refilter("runs");
    });
  }
  function press(buttons, chosen) {
    for (const each of buttons) each.setAttribute("aria-pressed", String(each === chosen));
  }
  for (const table of all("table.sortable")) {
    all("th", table).forEach((head, column) => {
      head.querySelector("button").addEventListener("click", () => sort(table, head, column));
    });
  }
  function sort(table, head, column) {
    const value = (row) => row.cells[column].dataset.sort;
    const numeric = all("tbody tr", table).every((row) => value(row) !== "" && !Number.isNaN(Number(value(row))));
    const compare = numeric
      ? (a, b) => Number(value(a)) - Number(value(b))
      : (a, b) => value(a).localeCompare(value(b), undefined, { numeric: true });
    const before = head.getAttribute("aria-sort");
    const falling = before ? before === "ascending" : numeric;
    for (const each of all("th", table)) each.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", falling ? "descending" : "ascending");
    const rows = all("tbody tr", table).sort((a, b) => (falling ? compare(b, a) : compare(a, b)));
    table.tBodies[0].append(...rows);
  }

  // ---- time ----

  let clock = DATA.timed ? "utc" : "start";
  const two = (number) => String(number).padStart(2, "0");
  function boot(t) {
    const book = (DATA.boots || [])[0];
    if (!book || !book.t.length) return null;
    let low = 0, high = book.t.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (book.t[middle] <= t) low = middle; else high = middle - 1;
    }
    const next = Math.min(low + 1, book.t.length - 1);
    const span = book.t[next] - book.t[low];
    const rises = book.y[next] >= book.y[low];
    const share = span > 0 && rises ? (t - book.t[low]) / span : 0;
    return book.y[low] + (rises ? share * (book.y[next] - book.y[low]) : t - book.t[low]);
  }
  function elapsed(t, step) {
    const sign = t < -1e-9 ? "-" : "";
    const digits = step < 1 ? 1 : 0;
    const whole = Math.abs(t), hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
    const seconds = (whole % 60).toFixed(digits).padStart(digits ? 4 : 2, "0");
    return hours ? `${sign}${hours}:${two(minutes)}:${seconds}` : `${sign}${minutes}:${seconds}`;
  }
  function say(t, step = 0.1) {
    if (t === null || t === undefined) return "";
    if (!DATA.timed) return `frame ${Math.round(t)}`;
    if (clock === "start") return elapsed(t, step);
    if (clock === "boot") {
      const since = boot(t);
      return since === null ? "?" : elapsed(since, step);
    }
    const date = new Date((DATA.start + t) * 1000);
    return date.toISOString().slice(11, step < 1 ? 21 : 19);
  }

  // ---- curves ----

  const ROLES = {
    claimed: { stroke: "vermillion", width: 2 },
    reference: { stroke: "blue", width: 3.5, alpha: 0.55 },
    corrected: { stroke: "green", width: 2, dash: [7, 4] },
    ellipsoid: { stroke: "purple", dash: [8, 4] },
    msl: { stroke: "blue" },
    home: { stroke: "orange" },
    origin: { stroke: "green", dash: [3, 3] },
    terrain: { stroke: "vermillion", dash: [10, 3, 2, 3] },
    ground: { stroke: "ground", width: 1.5 },
  };
  const NAMES = {
    ellipsoid: "above the ellipsoid", msl: "above mean sea level", home: "above home",
    origin: "above the local origin", terrain: "above terrain", ground: "the ground, above mean sea level",
  };
  const OTHERS = ["blue", "orange", "green", "purple", "vermillion", "sky"];
  const DASHES = [[], [8, 4], [3, 3], [10, 3, 2, 3], [14, 4], [5, 2, 2, 2]];

  function drawn(each, place) {
    const style = ROLES[each.role] || { stroke: OTHERS[place % 6], dash: DASHES[place % 6] };
    return {
      label: each.name || each.label,
      stroke: () => colour(style.stroke),
      width: style.width || 1.8,
      alpha: style.alpha || 1,
      dash: style.dash,
      points: { show: each.t.length < 60, size: 5, fill: () => colour(style.stroke) },
      value: (_, value) => (value === null || value === undefined ? "" : Number(value.toPrecision(6)).toString()),
    };
  }
  function aligned(series) {
    const tables = series.map((each) => [each.t, each.y]);
    return tables.length ? uPlot.join(tables, tables.map(() => [1, 2])) : [[]];
  }
  function plot(element, series, unit, width, height, more = {}) {
    const axis = { stroke: () => colour("faint"), grid: { stroke: () => colour("rule"), width: 1 }, ticks: { show: false } };
    return new uPlot({
      width, height,
      tzDate: (t) => new Date(t * 1000),
      scales: { x: { time: false } },
      cursor: { drag: { x: true, y: false, setScale: true }, points: { size: 7 } },
      series: [{ label: "time", value: (_, t) => say(t) }, ...series.map(drawn)],
      axes: [
        { ...axis, space: 90, size: 34, values: (_, ticks) => ticks.map((t) => say(t, ticks[1] - ticks[0] || 1)) },
        { ...axis, size: 66, label: unit, labelSize: 18, labelFont: "13px system-ui" },
      ],
      ...more,
    }, aligned(series), element);
  }

  const charts = [];
  function drawFigures(card) {
    for (const element of all(".chart[data-figure]", card)) {
      const figure = DATA.figures[element.dataset.figure];
      if (!figure || element.firstChild) continue;
      const width = Math.max(element.clientWidth, 280);
      charts.push([plot(element, figure.series, figure.unit, width, 230), element]);
    }
  }

  // ---- findings ----

  const cards = all("details.card");
  for (const card of cards) card.addEventListener("toggle", () => card.open && drawFigures(card));
  for (const button of all("button[data-cards]")) {
    button.addEventListener("click", () => cards.forEach((card) => { card.open = button.dataset.cards === "open"; }));
  }
  function reveal() {
    const card = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (card && card.matches("details.card")) card.open = true;
  }
  addEventListener("hashchange", reveal);
  addEventListener("beforeprint", () => {
    all("details").forEach((each) => { each.open = true; });
    cards.forEach(drawFigures);
  });

  // ---- the flight ----

  function flight() {
    const box = document.getElementById("flight");
    const times = [
      ...DATA.heights.flatMap((each) => [each.t[0], each.t[each.t.length - 1]]),
      ...DATA.bands.flatMap((each) => [each.from, each.to]),
      ...DATA.marks.flatMap((each) => [each.from, each.to]).filter((t) => t !== null),
    ].filter((t) => t !== undefined);
    if (!times.length || !DATA.timed && !DATA.heights.length) return;
    document.getElementById("timeline").hidden = false;
    const ends = [times.reduce((a, b) => Math.min(a, b)), times.reduce((a, b) => Math.max(a, b))];
    if (ends[1] - ends[0] < 1e-3) ends[1] = ends[0] + 1;
    const several = new Set(DATA.heights.map((each) => each.label.split(" ")[0])).size > 1;
    const seen = {};
    const named = DATA.heights.map((each) => {
      const said = NAMES[each.role] || each.role;
      const source = each.label.replace(/^\S+ /, "");
      const who = several ? `${each.label.split(" ")[0]} ` : "";
      seen[each.role] = (seen[each.role] || 0) + 1;
      return { ...each, name: `${who}${said} (${source})`, second: seen[each.role] > 1 };
    });
    const place = lanes();
    let view = ends;
    let level = named.some((each) => each.sea) ? "sea" : "said";
    const levelled = () => named.map((each) => (level === "said" ? each : { ...each, y: each.sea || each.y.map(() => null) }));
    const chart = plot(document.getElementById("heights"), levelled(), "height, m", box.clientWidth - 28, 300, {
      scales: { y: { range: (chart, low, high) => bulk(chart, view, low, high) }, x: { time: false, range: (_, low, high) => (view = low === null || low === undefined ? ends : [low, high]) } },
      hooks: { setScale: [(u, key) => key === "x" && place(u.scales.x.min, u.scales.x.max)], ready: [align], setSize: [align] },
    });
    named.forEach((each, k) => { if (each.second) chart.series[k + 1].width = 1; });
    const levels = all("button[data-level]");
    for (const button of levels) {
      button.hidden = !named.some((each) => each.sea);
      button.addEventListener("click", () => {
        level = button.dataset.level;
        press(levels, button);
        chart.setData(aligned(levelled()), false);
        chart.setScale("x", { min: chart.scales.x.min, max: chart.scales.x.max });
      });
    }
    charts.push([chart, document.getElementById("heights")]);
    const show = (low, high) => {
      const length = Math.min(Math.max(high - low, (ends[1] - ends[0]) / 5000), ends[1] - ends[0]);
      const from = Math.min(Math.max((low + high - length) / 2, ends[0]), ends[1] - length);
      chart.setScale("x", { min: from, max: from + length });
    };
    show(...ends);
    const moves = {
      in: (a, b) => [a + (b - a) / 4, b - (b - a) / 4],
      out: (a, b) => [a - (b - a) / 2, b + (b - a) / 2],
      left: (a, b) => [a - (b - a) / 4, b - (b - a) / 4],
      right: (a, b) => [a + (b - a) / 4, b + (b - a) / 4],
      all: () => ends,
    };
    const move = (name) => show(...moves[name](chart.scales.x.min, chart.scales.x.max));
    for (const button of all("button[data-move]")) button.addEventListener("click", () => move(button.dataset.move));
    const keys = { "+": "in", "=": "in", "-": "out", ArrowLeft: "left", ArrowRight: "right", 0: "all" };
    box.addEventListener("keydown", (event) => {
      const name = keys[event.key];
      if (!name || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      move(name);
    });
    chart.over.addEventListener("dblclick", () => move("all"));
    chart.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      move(event.deltaY < 0 ? "in" : "out");
    }, { passive: false });
    chart.over.addEventListener("mousedown", (event) => {
      if (!event.shiftKey) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      const { min, max } = chart.scales.x;
      const drag = (moved) => {
        const by = (moved.clientX - event.clientX) / chart.over.clientWidth * (max - min);
        show(min - by, max - by);
      };
      document.addEventListener("mousemove", drag);
      document.addEventListener("mouseup", () => document.removeEventListener("mousemove", drag), { once: true });
    }, true);
    const clocks = all("button[data-clock]");
    for (const button of clocks) {
      if (!DATA.timed || (button.dataset.clock === "boot" && !DATA.boots.length)) button.hidden = true;
      button.addEventListener("click", () => {
        clock = button.dataset.clock;
        press(clocks, button);
        for (const [each] of charts) each.redraw(false, true);
        place(chart.scales.x.min, chart.scales.x.max);
      });
    }
  }

  const ROWS = 6;

  // Bands of arming and modes, and the findings: each a lane above the curves.
  function lanes() {
    const box = document.getElementById("lanes");
    const placed = [];
    const modes = [...new Set(DATA.bands.filter((each) => each.kind === "mode").map((each) => each.label))];
    const systems = [...new Set(DATA.bands.map((each) => each.system))];
    for (const system of systems) {
      for (const kind of ["armed", "mode"]) {
        const lane = add(box, systems.length > 1 ? `${system} ${kind}` : kind);
        for (const band of DATA.bands.filter((each) => each.system === system && each.kind === kind)) {
          const look = kind === "armed" ? band.label : `k${modes.indexOf(band.label) % 6}`;
          const element = make("span", `band ${look}`, band.label);
          placed.push([lane.appendChild(element), band, () => `${band.label}, ${say(band.from)} to ${say(band.to)}`]);
        }
      }
    }
    const signs = { error: "\u2715", warning: "\u25b2", info: "\u25cf" };
    for (const severity of ["error", "warning", "info"]) {
      const marks = DATA.marks.filter((each) => each.severity === severity && each.from !== null);
      if (!marks.length) continue;
      const ends = [], rows = [];
      for (const mark of marks.sort((a, b) => a.from - b.from)) {
        const to = mark.to === null ? mark.from : mark.to;
        let row = ends.findIndex((end) => end < mark.from);
        if (row < 0) row = ends.length < ROWS ? ends.length : ROWS - 1;
        ends[row] = Math.max(to, ends[row] === undefined ? to : ends[row]);
        rows[row] = rows[row] || add(box, row ? "" : severity === "info" ? "info" : `${severity}s`, "marks");
        const element = make("a", `mark-at ${severity}`, `${signs[severity]} ${mark.label.split(" ")[0]}`);
        element.href = `#${mark.anchor}`;
        element.setAttribute("aria-label", mark.label);
        placed.push([rows[row].appendChild(element), { from: mark.from, to }, () => `${mark.label}, ${say(mark.from)} to ${say(to)}`]);
      }
    }
    return (min, max) => {
      for (const [element, { from, to }, title] of placed) {
        const left = Math.max((from - min) / (max - min), 0), right = Math.min((to - min) / (max - min), 1);
        element.hidden = right < 0 || left > 1;
        element.style.left = `${100 * left}%`;
        element.style.width = `${100 * Math.max(right - left, 0)}%`;
        element.title = title();
      }
    };
  }
  // The axis of heights shows the bulk of what is in view: a moment at zero must not flatten a flight.
  function bulk(chart, [from, to], low, high) {
    const seen = [];
    chart.data.slice(1).forEach((values, k) => {
      if (chart.series[k + 1].show) values.forEach((y, n) => {
        if (y !== null && y !== undefined && chart.data[0][n] >= from && chart.data[0][n] <= to) seen.push(y);
      });
    });
    if (!seen.length || low === null) return [0, 1];
    seen.sort((a, b) => a - b);
    const a = seen[Math.floor(seen.length * 0.02)], b = seen[Math.ceil(seen.length * 0.98) - 1];
    const margin = Math.max((b - a) * 0.5, 2);
    const range = [Math.max(low, a - margin), Math.min(high, b + margin)];
    const left = seen.filter((y) => y < range[0] || y > range[1]).length;
    document.getElementById("outside").textContent = left ? `${left} of ${seen.length} drawn values lie outside the axis` : "";
    const edge = Math.max((range[1] - range[0]) * 0.06, 0.5);
    return [range[0] - edge, range[1] + edge];
  }
  // Lanes begin and end where the plot does.
  function align(chart) {
    const inside = chart.over.getBoundingClientRect(), outside = document.getElementById("lanes").getBoundingClientRect();
    for (const lane of all(".lane")) {
      lane.firstChild.style.width = `${inside.left - outside.left}px`;
      lane.lastChild.style.marginRight = `${Math.max(outside.right - inside.right, 0)}px`;
    }
  }
  function add(box, name, look = "") {
    const lane = make("div", `lane ${look}`);
    lane.append(make("span", "", name), make("div", ""));
    box.append(lane);
    return lane.lastChild;
  }

  // ---- the map: zoom, move, and a scale bar that stays true ----

  function map(svg) {
    const [, , width, height] = svg.getAttribute("viewBox").split(" ").map(Number);
    const perM = Number(svg.dataset.perM);
    const fixed = all(".fixed", svg), texts = all(".mark, .far, .way", svg);
    const home = texts.map((each) => each.getAttribute("transform") || "");
    let view = { x: 0, y: 0, zoom: 1 };
    const apply = () => {
      const { x, y, zoom } = view;
      svg.setAttribute("viewBox", `${x} ${y} ${width / zoom} ${height / zoom}`);
      for (const each of fixed) each.setAttribute("transform", `translate(${x} ${y}) scale(${1 / zoom})`);
      texts.forEach((each, k) => each.setAttribute("transform", `${home[k]} scale(${each.matches(".far") ? 1 : 1 / zoom})`));
      bar(zoom);
    };
    const bar = (zoom) => {
      const most = width * 0.22 / (perM * zoom), power = 10 ** Math.floor(Math.log10(most));
      const metres = [5, 2, 1].map((k) => k * power).find((each) => each <= most * 1.000001);
      const length = metres * perM * zoom, scale = svg.querySelector(".scale");
      scale.querySelector("path").setAttribute("d", `M16 ${height - 24}v8h${length}v-8`);
      scale.querySelector("text").setAttribute("x", String(16 + length / 2));
      scale.querySelector("text").textContent = metres < 1000 ? `${Number(metres.toPrecision(3))} m` : `${metres / 1000} km`;
    };
    const zoom = (by, at = [0.5, 0.5]) => {
      const next = Math.min(Math.max(view.zoom * by, 0.05), 400);
      view.x += at[0] * (width / view.zoom - width / next);
      view.y += at[1] * (height / view.zoom - height / next);
      view.zoom = next;
      apply();
    };
    const acts = { in: () => zoom(1.6), out: () => zoom(1 / 1.6), all: () => { view = { x: 0, y: 0, zoom: 1 }; apply(); } };
    for (const button of all("button[data-map]")) button.addEventListener("click", acts[button.dataset.map]);
    svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      const box = svg.getBoundingClientRect();
      zoom(event.deltaY < 0 ? 1.25 : 0.8, [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height]);
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      const from = { ...view }, per = width / view.zoom / svg.getBoundingClientRect().width;
      const drag = (moved) => {
        view.x = from.x - (moved.clientX - event.clientX) * per;
        view.y = from.y - (moved.clientY - event.clientY) * per;
        apply();
      };
      svg.addEventListener("pointermove", drag);
      svg.addEventListener("pointerup", () => svg.removeEventListener("pointermove", drag), { once: true });
    });
    svg.addEventListener("keydown", (event) => {
      const step = 40 / view.zoom;
      const steps = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
      const named = { "+": "in", "=": "in", "-": "out", 0: "all" }[event.key];
      if (named) acts[named]();
      else if (steps[event.key]) { view.x += steps[event.key][0]; view.y += steps[event.key][1]; apply(); }
      else return;
      event.preventDefault();
    });
  }

  if (typeof uPlot !== "undefined") {
    flight();
    cards.filter((card) => card.open).forEach(drawFigures);
    addEventListener("resize", () => {
      for (const [chart, element] of charts) chart.setSize({ width: Math.max(element.clientWidth, 280), height: chart.height });
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(([chart]) => chart.redraw(false, true)));
  }
  const big = document.querySelector("#map .plan");
  if (big) map(big);
  reveal();
  document.documentElement.dataset.ready = "yes";
})();
