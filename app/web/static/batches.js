// A batch as it fills: its counters by server-sent events, and its items as points of a map.
const progress = document.querySelector("#progress"), map = document.querySelector("#map");
const PALETTE = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#999999"];
const SVG = "http://www.w3.org/2000/svg";
const BOX = { left: 78, top: 16, bottom: 420 };
// As wide as the page has room, so that words keep their size on a phone.
const width = () => Math.round(Math.max(340, Math.min(760, map.clientWidth)));

function made(name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

function lasting(seconds) {
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  return seconds < 5400 ? `${Math.ceil(seconds / 60)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

function show(batch) {
  for (const place of progress.querySelectorAll("[data-count]")) {
    const { count, words } = place.dataset;
    place.textContent = count === "status" ? JSON.parse(words)[batch.status] : batch.items[count];
  }
  progress.querySelector("progress").value = batch.items.done;
  const pace = batch.rate_per_s ? `, ${batch.rate_per_s.toPrecision(3)} / s` : "";
  const rest = batch.remaining_s ? `, ≈ ${lasting(batch.remaining_s)} ${progress.dataset.left}` : "";
  progress.querySelector(".pace").textContent = pace + rest;
}

// What a person looks at first, of the results of every kind.
const FIRST = ["mass_g", "fatigue_safety", "longest_link_mm", "mean_torque_nm", "rod_mass_kg"];

// Names of fields, and values that are no numbers, as the service words them, in the language of the page.
const worded = (told, name) => told.words[name] ?? name.replaceAll("_", " ");
const valued = (told, value) => told.values[value] ?? value.replaceAll("_", " ");

function fill(select, told, groups, chosen) {
  if (select.options.length) return;
  for (const name of groups) select.add(new Option(worded(told, name), name, false, name === chosen));
}

function numbersOf(values) {
  return values.filter((value) => typeof value === "number");
}

function ticks(low, high) {
  const span = high - low || Math.abs(high) || 1, raw = span / 6, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((each) => each >= raw);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return found;
}

function scale(values, from, to) {
  let low = Infinity, high = -Infinity;
  for (const value of values) { low = Math.min(low, value); high = Math.max(high, value); }
  if (low === high) { low -= Math.abs(low) * 0.05 || 1; high += Math.abs(high) * 0.05 || 1; }
  return { low, high, at: (value) => from + ((value - low) / (high - low)) * (to - from) };
}

function coloured(told, values) {
  const numbers = numbersOf(values);
  if (numbers.length && new Set(numbers).size > PALETTE.length) {
    const along = scale(numbers, 0, 1);
    const of = (value) => (typeof value === "number" ? `hsl(${Math.round(260 - 200 * along.at(value))} 70% 48%)` : PALETTE[6]);
    return { of, legend: [along.low, (along.low + along.high) / 2, along.high].map((v) => [v.toPrecision(4), of(v)]) };
  }
  const words = [...new Set(values.map((value) => String(value ?? "")))].sort();
  const of = (value) => PALETTE[Math.min(words.indexOf(String(value ?? "")), PALETTE.length - 1)];
  return { of, legend: words.slice(0, 12).map((word) => [valued(told, word), PALETTE[Math.min(words.indexOf(word), 6)]]) };
}

function draw(told, names) {
  const picture = map.querySelector("svg"), column = (name) => told.fields.lastIndexOf(name), right = width() - 20;
  picture.setAttribute("viewBox", `0 0 ${width()} 470`);
  const [x, y, colour] = names.map(column);
  const there = told.points.filter((p) => typeof p[x] === "number" && typeof p[y] === "number");
  picture.replaceChildren(made("rect", {
    class: "frame", x: BOX.left, y: BOX.top, width: right - BOX.left, height: BOX.bottom - BOX.top,
  }));
  if (!there.length) {
    picture.append(made("text", { x: right / 2, y: 220, "text-anchor": "middle" }, map.dataset.none));
    return;
  }
  const across = scale(there.map((p) => p[x]), BOX.left + 8, right - 8);
  const up = scale(there.map((p) => p[y]), BOX.bottom - 8, BOX.top + 8);
  for (const value of ticks(across.low, across.high)) {
    picture.append(made("text", { x: across.at(value), y: BOX.bottom + 18, "text-anchor": "middle" }, +value.toPrecision(6)));
  }
  for (const value of ticks(up.low, up.high)) {
    picture.append(made("text", { x: BOX.left - 6, y: up.at(value) + 4, "text-anchor": "end" }, +value.toPrecision(6)));
  }
  picture.append(made("text", { x: (BOX.left + right) / 2, y: 460, "text-anchor": "middle" }, worded(told, names[0])));
  picture.append(made("text", { x: 14, y: 218, transform: "rotate(-90 14 218)", "text-anchor": "middle" }, worded(told, names[1])));
  const shade = (point) => point[colour] ?? point[2]; // an item without a value is told by its status
  const paint = coloured(told, there.map(shade));
  const radius = there.length > 1000 ? 2.5 : 4;
  for (const point of there) {
    const link = made("a", { href: `/runs/${point[1]}` });
    const dot = made("circle", { cx: across.at(point[x]), cy: up.at(point[y]), r: radius, ...painted(point, paint.of(shade(point))) });
    dot.append(made("title", {}, `${point[0] + 1}: ${valued(told, point[2])}`));
    link.append(dot);
    picture.append(link);
  }
  const hollow = there.some(fails) ? [[map.dataset.hollow, { fill: "none", stroke: PALETTE[6] }]] : [];
  const entries = [...paint.legend.map(([word, fillColour]) => [word, { fill: fillColour }]), ...hollow];
  map.querySelector(".legend").replaceChildren(...entries.map(([word, look]) => {
    const item = document.createElement("li"), sign = made("svg", { viewBox: "0 0 12 12", "aria-hidden": "true" });
    sign.append(made("circle", { cx: 6, cy: 6, r: 4.5, "stroke-width": 1.5, ...look }));
    item.append(sign, ` ${word}`);
    return item;
  }));
}

// Every point begins with its index, run, status and whether its part holds.
const fails = (point) => point[3] === false;
const painted = (point, colour) => (fails(point) ? { class: "fails", fill: "transparent", stroke: colour } : { fill: colour });

// More than two varied fields: an axis for each and for a result, and every item as a line across them.
const ALONG = { left: 50, top: 44, bottom: 300, most: 1500 };

function drawBeside(told, names, colour) {
  const place = map.querySelector("#beside"), picture = place.querySelector("svg");
  const columns = names.map((name) => told.fields.lastIndexOf(name)), painted = told.fields.lastIndexOf(colour);
  const there = told.points.filter((p) => columns.every((column) => typeof p[column] === "number"));
  place.hidden = names.length < 3 || !there.length;
  if (place.hidden) return;
  const at = (k) => ALONG.left + (k * (width() - 2 * ALONG.left)) / (names.length - 1);
  picture.setAttribute("viewBox", `0 0 ${width()} 345`);
  const axes = columns.map((column) => scale(there.map((p) => p[column]), ALONG.bottom, ALONG.top));
  const paint = coloured(told, there.map((p) => p[painted])), every = Math.ceil(there.length / ALONG.most);
  picture.replaceChildren();
  for (const point of there.filter((_, k) => k % every === 0)) {
    const link = made("a", { href: `/runs/${point[1]}` });
    const path = axes.map((axis, k) => `${at(k)},${axis.at(point[columns[k]]).toFixed(1)}`).join(" ");
    const line = made("polyline", { points: path, fill: "none", stroke: paint.of(point[painted]), "stroke-opacity": 0.5 });
    line.append(made("title", {}, `${point[0] + 1}: ${valued(told, point[2])}`));
    link.append(line);
    picture.append(link);
  }
  axes.forEach((axis, k) => {
    picture.append(made("line", { class: "frame", x1: at(k), x2: at(k), y1: ALONG.top, y2: ALONG.bottom }));
    const words = [[axis.low, ALONG.bottom + 16], [axis.high, ALONG.top - 8]];
    for (const [value, y] of words) picture.append(made("text", { x: at(k), y, "text-anchor": "middle" }, +value.toPrecision(5)));
    picture.append(made("text", { x: at(k), y: 16, "text-anchor": "middle", class: "number" }, k + 1));
  });
  // The names of many axes would run into each other.
  place.querySelector("ol").replaceChildren(...names.map((name) => {
    const item = document.createElement("li");
    item.textContent = worded(told, name);
    return item;
  }));
}

let busy = false, again = false;
async function refresh() {
  if (busy) { again = true; return; }
  busy = true;
  try {
    const selects = ["x", "y", "colour"].map((name) => map.querySelector(`#map-${name}`));
    let names = selects.map((select) => select.value);
    let beside = [];
    const ask = async () => {
      const [x, y, colour] = names;
      return (await fetch(`${map.dataset.points}?${new URLSearchParams({ x, y, colour, beside })}`)).json();
    };
    let told = await ask();
    const all = [...told.varied, ...told.results];
    if (all.length && !selects[0].options.length) {
      fill(selects[0], told, all, all[0]);
      fill(selects[1], told, all, told.varied[1] ?? FIRST.find((name) => told.results.includes(name)) ?? all[1] ?? all[0]);
      fill(selects[2], told, ["governed_by", "status", "holds", ...all], "governed_by");
      names = selects.map((select) => select.value);
      told = await ask();
    }
    if (told.varied.length > 2) {
      const result = told.varied.includes(names[1]) ? FIRST.find((name) => told.results.includes(name)) : names[1];
      beside = [...told.varied.slice(0, 8), result ?? told.results[0]].filter(Boolean);
      told = await ask();
    }
    if (names[0]) draw(told, names);
    drawBeside(told, beside, names[2]);
  } finally {
    busy = false;
    if (again) { again = false; setTimeout(refresh, 300); }
  }
}

map.querySelector(".axes").addEventListener("change", refresh);
refresh();
function follow() {
  const events = new EventSource(progress.dataset.events);
  let due = 0;
  const told = (event) => {
    show(JSON.parse(event.data));
    if (event.type === "ended" || Date.now() > due) { due = Date.now() + 2000; refresh(); }
  };
  events.addEventListener("progress", told);
  events.addEventListener("ended", (event) => { events.close(); told(event); location.reload(); });
  // A service that is busy or starting anew refuses, after which a browser does not ask again by itself.
  events.addEventListener("error", () => { if (events.readyState === EventSource.CLOSED) setTimeout(follow, 2000); });
}
if (progress.dataset.events) follow();
