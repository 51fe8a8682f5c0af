// A linkage's picture: paused, played and scrubbed, with a cursor at the same crank angle in the pictures over the cycle.
const figureOf = (name) => document.querySelector(`figure[data-plot="${name}"]`);

async function inlined(figure) {
  const image = figure.querySelector("picture") || figure.querySelector("img");
  const answer = await patient(figure.querySelector("img").getAttribute("src"));
  if (!answer.ok) return null;
  const text = await answer.text();
  // The page's own style knows the pictures' colours; a style within would be refused.
  const plain = text.replace(/<style>.*?<\/style>/s, "");
  const svg = document.importNode(new DOMParser().parseFromString(plain, "image/svg+xml").documentElement, true);
  image.replaceWith(svg);
  return svg;
}

async function player(figure) {
  const svg = await inlined(figure);
  const motion = svg && svg.querySelector("animate");
  if (!motion) return;
  const seconds = parseFloat(motion.getAttribute("dur"));
  const cursors = [];
  for (const name of ["transfer", "loads"]) {
    const other = figureOf(name);
    if (other) {
      const chart = await inlined(other);
      if (!chart) continue;
      const { left, right, top, bottom } = chart.dataset;
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      line.setAttribute("class", "cursor");
      line.setAttribute("y1", top);
      line.setAttribute("y2", bottom);
      chart.append(line);
      cursors.push((share) => {
        const x = +left + share * (right - left);
        line.setAttribute("x1", x);
        line.setAttribute("x2", x);
      });
    }
  }
  const [play, pause, angle] = figure.dataset.words.split("|");
  const bar = document.createElement("div");
  bar.className = "player";
  const button = document.createElement("button");
  button.type = "button";
  const range = Object.assign(document.createElement("input"), { type: "range", min: 0, max: 360, step: 1 });
  range.setAttribute("aria-label", angle);
  const told = document.createElement("output");
  bar.append(button, range, told);
  svg.after(bar);
  let playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const show = (degrees) => {
    range.value = degrees;
    told.textContent = `${Math.round(degrees)}°`;
    cursors.forEach((move) => move(degrees / 360));
  };
  const at = (degrees) => {
    svg.setCurrentTime((degrees / 360) * seconds);
    show(degrees);
  };
  const set = (wanted) => {
    playing = wanted;
    button.textContent = playing ? pause : play;
    playing ? svg.unpauseAnimations() : svg.pauseAnimations();
    if (playing) requestAnimationFrame(follow);
  };
  const follow = () => {
    if (!playing) return;
    show(((svg.getCurrentTime() / seconds) % 1) * 360);
    requestAnimationFrame(follow);
  };
  button.addEventListener("click", () => set(!playing));
  range.addEventListener("input", () => {
    const wanted = +range.value;
    set(false);
    at(Math.min(wanted, 359.9));
  });
  if (!playing) at(0);
  set(playing);
  figure.dataset.ready = "true";
}

const mechanism = figureOf("mechanism");
if (mechanism) player(mechanism);
