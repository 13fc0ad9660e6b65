// The page says so where the server answers no more: it would else look ready.
const ASKED_AFTER = 3000, PATIENCE = 20000;  // after each answer; of a server that is busy [ms]
const LOST = "Connection lost: the studio does not answer. Start it again with the same scan or project, which is saved after each step.";
const lost = document.createElement("div");
lost.setAttribute("role", "alert");
lost.style.cssText = "position:fixed;top:0;left:0;right:0;z-index:1000;padding:.6em 1em;background:#a61e1e;color:#fff;font:1em sans-serif;display:none";
const ask = async () => {
  let answers = true;
  try {
    await fetch("alive", { cache: "no-store", signal: AbortSignal.timeout(PATIENCE) });
  } catch {
    answers = false;
  }
  const words = answers ? "" : LOST;
  if (lost.textContent !== words) lost.textContent = words;
  lost.style.display = answers ? "none" : "block";
  setTimeout(ask, ASKED_AFTER);
};
addEventListener("DOMContentLoaded", () => {
  document.body.append(lost);
  setTimeout(ask, ASKED_AFTER);
});
