// What a page loads later is asked for again while the service is busy.
async function patient(address) {
  for (;;) {
    const answer = await fetch(address);
    if (answer.status !== 429 && answer.status !== 503) return answer;
    await new Promise((resolve) => setTimeout(resolve, 3000));
  }
}
addEventListener("error", async ({ target }) => {
  if (target.tagName === "IMG" && (await patient(target.src)).ok) target.src = target.src;
}, true);
