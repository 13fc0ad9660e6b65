// No press is lost, and nothing that is typed, however busy the page is.

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

// What the server writes into a field in which a person is typing moves the caret, or comes between two keys: before the next character
// the field is as the person has left it.
const TYPES_ON = 3000;  // after the last character [ms]
const MOVES_CARET = /^(Arrow|Home|End|Page|Tab|Escape)/;
let chosen = null, typed = null;  // the field whose whole text is selected; what was typed last, and where the caret stood
const isText = (field) => field.matches?.("input[type=text], input:not([type]), textarea");
addEventListener("select", ({ target: field }) => {
  if (isText(field)) chosen = field.selectionEnd - field.selectionStart === field.value.length ? field : null;
}, true);
for (const kind of ["keydown", "pointerdown", "focusout"]) {
  addEventListener(kind, (event) => {
    if (kind !== "keydown" || MOVES_CARET.test(event.key)) chosen = typed = null;
  }, true);
}
addEventListener("input", ({ target: field }) => {
  chosen = null;
  typed = isText(field) ? { field, text: field.value, caret: field.selectionStart, at: performance.now() } : null;
}, true);
addEventListener("beforeinput", ({ target: field }) => {
  if (field === chosen) {
    if (field.selectionStart === field.selectionEnd) field.select();
    return;
  }
  if (field !== typed?.field || field.value === typed.text || performance.now() - typed.at > TYPES_ON) return;
  Object.getOwnPropertyDescriptor(Object.getPrototypeOf(field), "value").set.call(field, typed.text);
  field.setSelectionRange(typed.caret, typed.caret);
}, true);
