// No press is lost, however busy the page is.

// A press means the control it began on, wherever that has gone before the pointer comes up: a browser makes no click of it then.
const CONTROLS = "button, input[type=checkbox], [role=button], [role=option]";
const HELD_STILL = 6;  // a pointer that has moved farther takes its press back [pixel]
let begun = null;
addEventListener("pointerdown", (event) => {
  const control = event.button === 0 ? event.target.closest?.(CONTROLS) : null;
  begun = control && { control, x: event.clientX, y: event.clientY };
}, true);
addEventListener("pointerup", (event) => {
  const press = begun;
  begun = null;
  if (!press || press.control.contains(event.target) || !press.control.isConnected) return;
  if (Math.hypot(event.clientX - press.x, event.clientY - press.y) <= HELD_STILL) press.control.click?.();  // which a part of a picture has not
}, true);

// Viser sends one message of a panel in 50 ms, the last: clicks that a busy page takes at once wait for one another.
const APART = 60;  // [ms]
const SENDS = "button, input[type=checkbox], [role=option]";
let free = 0, passes = null;  // when the next may be sent; the click that has waited
addEventListener("input", () => { free = Math.max(free, performance.now() + APART); }, true);
addEventListener("click", (event) => {
  const control = event.target.closest?.(SENDS);
  if (!control || control === passes) return;
  const now = performance.now(), waits = free - now;
  free = Math.max(free, now) + APART;
  if (waits <= 0) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  setTimeout(() => {
    passes = control;
    control.click();
    passes = null;
  }, waits);
}, true);
