// The page says so where the server answers no more, for it would else look ready, and goes on when it is back: viser connects again by itself
// while somebody looks at the page, and where it does not the page loads again.
const ASKED_AFTER = 3000, ASKED_WHILE_LOST = 1000, PATIENCE = 20000;  // after each answer; until all is well; of a server that is busy [ms]
const WAITS = 8;  // for viser, once the server is back
const LOST = "Connection lost: the studio does not answer. Start it again with the same scan or project, which is saved after each step; this page then goes on by itself.";
const lost = document.createElement("div");
lost.setAttribute("role", "alert");
lost.style.cssText = "position:fixed;top:0;left:0;right:0;z-index:1000;padding:.6em 1em;background:#a61e1e;color:#fff;font:1em sans-serif;display:none";
const panel = () => document.querySelector(".studio-head")?.parentElement;  // another one after each connection
let server = null, before = null, waited = 0;  // the server and the panel when all was well
const ask = async () => {
  let name = null;
  try {
    name = await (await fetch("alive", { cache: "no-store", signal: AbortSignal.timeout(PATIENCE) })).text();
  } catch {
    if (lost.textContent !== LOST) lost.textContent = LOST;
  }
  const isWell = name !== null && (server === null || (name === server && !lost.textContent) || panel() !== before);
  if (isWell) [server, before, waited, lost.textContent] = [name, panel(), 0, ""];
  else if (name !== null && ++waited > WAITS) return location.reload();
  lost.style.display = lost.textContent ? "block" : "none";
  setTimeout(ask, isWell ? ASKED_AFTER : ASKED_WHILE_LOST);
};
addEventListener("DOMContentLoaded", () => {
  document.body.append(lost);
  ask();
});
