// Forms: what applies is shown, tables are edited by cells, and the part is drawn and judged while one types.
// Without this file the same forms are filled in and sent all the same.
"use strict";
(() => {
  const form = document.getElementById("the-form");
  const title = document.getElementById("the-title");
  const drawing = document.getElementById("the-drawing");
  const caption = document.getElementById("the-caption");
  const live = document.getElementById("the-answer");
  const json = document.getElementById("the-json");
  const words = JSON.parse(form.dataset.words);
  const say = (name, parts = {}) => words[name].replace(/\{(\w+)\}/g, (_, part) => parts[part]);

  // -- what applies ----------------------------------------------------------------------------------------------
  const applies = (when, sent) =>
    when.split("|").some((way) => way.split("&").every((condition) => {
      const [name, values] = condition.split("=");
      return values.split(",").includes(sent.get(name) ?? "");
    }));

  function showWhatApplies() {
    const sent = new FormData(form);
    for (const part of form.querySelectorAll("[data-when]")) part.toggleAttribute("data-off", !applies(part.dataset.when, sent));
  }

  // -- tables: cells over a text of lines, which is what is sent ---------------------------------------------------
  const MOST_ROWS = 400;
  // As the service splits lines: at tabs or semicolons, else at spaces but those before units; at commas where that gives
  // as many as columns.
  function cellsOf(line, columns) {
    if (/[\t;]/.test(line)) return line.split(/[\t;]/).map((cell) => cell.trim());
    const cells = line.trim().split(/\s+(?![\p{L}°"])/u).map((cell) => cell.replace(/,$/, ""));
    const listed = line.split(",").map((cell) => cell.trim());
    return cells.length === 1 && listed.length === columns ? listed : cells;
  }
  // What does not fit stays with the last cell, where the service refuses it.
  const fitted = (cells, columns) => cells.length > columns
    ? [...cells.slice(0, columns - 1), cells.slice(columns - 1).filter((cell) => cell !== "").join("; ")] : cells;
  // The rows of pasted or dropped text, without headings on top of the figures; what is no figure below them is kept and
  // refused.
  function rowsOf(text, columns) {
    const lines = text.replace(/\r/g, "").split("\n").filter((line) => line.trim() !== "");
    const rows = lines.map((line) => cellsOf(line, columns));
    const first = rows.findIndex((row) => /^[-+\u2212\u2013.,]?\d/.test(row.find((cell) => cell !== "") ?? ""));
    return first < 0 ? [] : rows.slice(first);
  }
  const tables = [];

  function make(tag, attributes = {}, text = "") {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.textContent = text;
    return made;
  }

  function table(area) {
    const headings = area.dataset.headings.split("|");
    const label = form.querySelector(`label[for="${CSS.escape(area.id)}"]`);
    const cells = make("div", { class: "cells", role: "group", "aria-label": label.textContent });
    const body = make("tbody");
    const grid = make("table");
    const head = make("tr");
    head.append(make("td", { class: "row" }), ...headings.map((words) => make("th", { scope: "col" }, words)), make("td"));
    const top = make("thead");
    top.append(head);
    grid.append(top, body);
    cells.append(grid);
    const add = make("button", { type: "button" }, say("add_row"));
    const text = make("button", { type: "button", "aria-pressed": "false" }, say("as_text"));
    const buttons = make("div", { class: "rows" });
    buttons.append(add, text);
    area.after(cells, buttons);

    const inputs = (row) => [...row.querySelectorAll("input")];
    function write() {
      area.value = [...body.rows].map((row) => inputs(row).map((input) => input.value.trim().replace(/\s+/g, "")).join("\t"))
        .filter((line) => line.trim() !== "").join("\n");
    }
    function number() {
      [...body.rows].forEach((row, i) => {
        row.cells[0].textContent = i + 1;
        inputs(row).forEach((input, j) => input.setAttribute("aria-label", say("cell", { heading: headings[j], row: i + 1 })));
      });
    }
    function newRow(values = [], after = null) {
      const row = make("tr");
      row.append(make("td", { class: "row" }));
      headings.forEach((_, i) => {
        const cell = make("td");
        const input = make("input", { inputmode: "decimal", "data-path": area.dataset.path });
        input.value = values[i] ?? "";
        cell.append(input);
        row.append(cell);
      });
      const gone = make("td", { class: "gone" });
      gone.append(make("button", { type: "button", "aria-label": say("remove_row") }, "×"));
      row.append(gone);
      if (after) after.after(row); else body.append(row);
      return row;
    }
    function read() {
      const lines = area.value.split("\n").filter((line) => line.trim() !== "");
      const large = lines.length > MOST_ROWS;
      body.replaceChildren();
      if (!large) lines.forEach((line) => newRow(fitted(cellsOf(line, headings.length), headings.length)));
      number();
      const plain = large || text.getAttribute("aria-pressed") === "true";
      area.hidden = !plain;
      cells.hidden = add.hidden = plain;
    }
    body.addEventListener("input", write);
    body.addEventListener("click", (event) => {
      if (event.target.tagName !== "BUTTON") return;
      const row = event.target.closest("tr");
      const next = row.nextElementSibling ?? row.previousElementSibling;
      row.remove();
      number();
      write();
      (next?.querySelector("input") ?? add).focus();
      changed();
    });
    body.addEventListener("keydown", (event) => {
      const row = event.target.closest("tr");
      const column = row ? inputs(row).indexOf(event.target) : -1;
      if (column < 0) return;
      if (event.key === "Enter") {
        event.preventDefault();
        const below = row.nextElementSibling ?? newRow([], row);
        number();
        inputs(below)[column].focus();
      } else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
        const next = event.key === "ArrowDown" ? row.nextElementSibling : row.previousElementSibling;
        if (next) { event.preventDefault(); inputs(next)[column].focus(); }
      }
    });
    // What a spreadsheet puts on the clipboard fills the cells from here on, to the right and down.
    body.addEventListener("paste", (event) => {
      const pasted = event.clipboardData.getData("text");
      const lines = pasted.replace(/\r/g, "").split("\n").filter((line) => line.trim() !== "");
      if (lines.length < 2 && !/[\t;]/.test(pasted)) return;
      event.preventDefault();
      let row = event.target.closest("tr");
      const first = inputs(row).indexOf(event.target);
      const columns = headings.length - first;
      // Where commas are decimal ones, "0,5" is rather one number than two.
      const atCommas = columns > 2 || document.documentElement.lang === "en";
      rowsOf(pasted, atCommas ? columns : 1).forEach((values, i) => {
        if (i) row = row.nextElementSibling ?? newRow([], row);
        fitted(values, columns).forEach((value, j) => { inputs(row)[first + j].value = value; });
      });
      number();
      write();
      read();
      changed();
    });
    add.addEventListener("click", () => { const row = newRow(); number(); row.querySelector("input").focus(); });
    text.addEventListener("click", () => {
      text.setAttribute("aria-pressed", String(text.getAttribute("aria-pressed") !== "true"));
      text.textContent = text.getAttribute("aria-pressed") === "true" ? say("as_cells") : say("as_text");
      read();
    });
    // A file of points dropped on the table, or on its text, takes the place of what is there.
    for (const target of [cells, area]) {
      target.addEventListener("dragover", (event) => event.preventDefault());
      target.addEventListener("drop", async (event) => {
        const [file] = event.dataTransfer.files;
        if (!file) return;
        event.preventDefault();
        area.value = rowsOf(await file.text(), headings.length).map((row) => row.join("\t")).join("\n");
        read();
        changed();
      });
    }
    tables.push({ area, read });
    read();
  }

  // -- sliders -----------------------------------------------------------------------------------------------------
  const value = (text) => Number(text.replace(/\s/g, "").replace(",", "."));
  function slider(input) {
    const range = make("input", { type: "range", "aria-label": say("slider", { label: form.querySelector(`label[for="${CSS.escape(input.id)}"]`)?.textContent ?? "" }), "data-path": input.dataset.path });
    const settle = () => {
      const now = value(input.value);
      range.hidden = !(now > 0);
      if (now > 0) Object.assign(range, { min: now / 2, max: now * 2, step: now / 200, value: now });
    };
    range.addEventListener("input", () => { input.value = String(Number(Number(range.value).toPrecision(4))); });
    range.addEventListener("change", settle);
    input.addEventListener("change", settle);
    input.closest(".entry").after(range);
    settle();
    return settle;
  }

  // -- the drawing lights up what one is at ------------------------------------------------------------------------
  let path = "";
  function light() {
    for (const mark of drawing.querySelectorAll("[data-for]")) mark.classList.toggle("lit", mark.dataset.for === path);
  }
  form.addEventListener("focusin", (event) => { path = event.target.dataset.path ?? ""; light(); });
  drawing.addEventListener("click", (event) => {
    const wanted = event.target.closest("[data-for]")?.dataset.for;
    const field = wanted && [...form.querySelectorAll(`[data-path="${CSS.escape(wanted)}"]:not([type=range])`)].find((one) => one.offsetParent);
    if (field) field.focus();
  });

  // -- drawn and judged while one types: one request at a time, the last state wins --------------------------------
  const WAIT = 200, RETRY = 3000;
  let timer = 0, busy = false, again = false;

  function changed() {
    showWhatApplies();
    clearTimeout(timer);
    timer = setTimeout(ask, WAIT);
  }

  const send = (address) => fetch(address, { method: "POST", body: new URLSearchParams(new FormData(form)) });

  function showFaults(faults, others) {
    for (const place of form.querySelectorAll(".error")) {
      const name = place.id.replace(/-error$/, "");
      const words = faults[name] ?? "";
      if (place.textContent !== words) place.textContent = words;
      const field = document.getElementById(name);
      if (field) { if (words) field.setAttribute("aria-invalid", "true"); else field.removeAttribute("aria-invalid"); }
    }
    const count = Object.keys(faults).length + others.length;
    // What was refused when the form was sent is mended.
    if (!count) document.getElementById("the-faults")?.remove();
    if (count) live.innerHTML = "";
    if (count) live.append(make("p", { class: "summary fails" }, `${say("refused", { count })} ${others.join("; ")}`));
    else if (!form.dataset.answer) live.replaceChildren();
    return count;
  }

  // The service may be busy or starting anew: it is asked again, at once if one types.
  function later(why) {
    if (live.textContent !== why) live.replaceChildren(make("p", { class: "summary" }, why));
    clearTimeout(timer);
    timer = setTimeout(ask, RETRY);
  }

  async function ask() {
    if (busy) { again = true; return; }
    busy = true;
    try {
      const sent = await send(form.dataset.drawing);
      if (sent.status === 401) return live.replaceChildren(make("p", { class: "summary" }, say("logged_out")));
      const drawn = await sent.json();
      if (drawn.svg) { drawing.innerHTML = drawn.svg; light(); }
      document.title = document.title.replace(title.textContent, drawn.title);
      title.textContent = drawn.title;
      caption.textContent = drawn.svg ? drawn.caption : drawing.firstChild ? say("last_drawing") : say("no_drawing");
      json.textContent = drawn.json;
      if (!showFaults(drawn.faults, drawn.others) && form.dataset.answer && !again) {
        live.setAttribute("aria-busy", "true");
        const answer = await send(form.dataset.answer);
        if (answer.ok) live.innerHTML = await answer.text();
        else if (answer.status === 422) { const told = await answer.json(); showFaults(told.faults, told.others); }
        else if (answer.status === 503) later(say("busy", await answer.json()));
        else live.replaceChildren(make("p", { class: "summary" }, say("no_answer")));
      }
    } catch { later(say("silent")); }
    finally { busy = false; live.removeAttribute("aria-busy"); }
    if (again) { again = false; ask(); }
  }

  const settles = [...form.querySelectorAll("input[data-slider]")].map(slider);
  form.querySelectorAll("textarea[data-headings]").forEach(table);
  form.addEventListener("input", changed);
  form.addEventListener("change", changed);
  // A part that is wrong must not stay folded away.
  for (const place of form.querySelectorAll("details .error:not(:empty)")) place.closest("details").open = true;
  // After Back the browser puts in what was typed, after this script has run.
  addEventListener("pageshow", () => setTimeout(() => {
    tables.forEach(({ read }) => read());
    settles.forEach((settle) => settle());
    showWhatApplies();
    if (!document.getElementById("the-faults")) ask();
  }));
})();
