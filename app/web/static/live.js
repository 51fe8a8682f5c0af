// Follows runs under way: shows how far they are, and loads the page again once one has ended.
for (const place of document.querySelectorAll("[data-live]")) {
  const steps = JSON.parse(place.dataset.steps ?? "{}");
  const bar = place.querySelector("progress"), words = place.querySelector(".doing");
  const look = async () => {
    try {
      const answer = await fetch(place.dataset.live);
      if (answer.status >= 429) throw answer;
      const run = await answer.json();
      if (run.status !== "queued" && run.status !== "running") return location.reload();
      if (run.progress && bar) {
        bar.max = run.progress.of;
        bar.value = run.progress.done;
        words.textContent = place.dataset.words.replace(/\{(\w+)\}/g, (_, name) => (name === "doing" && steps[run.progress.doing]) || run.progress[name]);
      }
    } catch { /* The service may be busy or starting anew: look again. */ }
    setTimeout(look, 700);
  };
  setTimeout(look, 500);
}
