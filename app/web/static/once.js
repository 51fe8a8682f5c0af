// What a form starts is started once, however often its button is clicked while the answer is awaited.
let sent = false;
addEventListener("submit", (event) => {
  if (event.target.method !== "post") return;
  if (sent) event.preventDefault();
  sent = true;
  setTimeout(() => { sent = false; }, 5000);
});
// After Back the page may be as it was left.
addEventListener("pageshow", () => { sent = false; });
