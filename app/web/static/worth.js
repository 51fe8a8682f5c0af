// What one per cent of a limit is worth takes some designs more: it comes after the page.
for (const place of document.querySelectorAll("[data-worth]")) {
  fetch(place.dataset.worth).then(async (answer) => { if (answer.ok) place.innerHTML = await answer.text(); }).catch(() => {});
}
