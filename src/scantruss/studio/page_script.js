// A file that is dropped anywhere on the page is opened as if it had been chosen with the first upload button.
const held = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
addEventListener("dragover", (event) => { if (held(event)) event.preventDefault(); });
addEventListener("drop", (event) => {
  const input = document.querySelector("input[type=file]");
  if (!held(event) || !input) return;
  event.preventDefault();
  const one = new DataTransfer();
  one.items.add(event.dataTransfer.files[0]);
  input.files = one.files;
  input.dispatchEvent(new Event("change", { bubbles: true }));
});

// A file that is too large is not sent at all: it would fill the memory of browser and server before it is refused.
addEventListener("change", (event) => {
  const words = document.querySelector("[data-largest]");
  if (!words || event.target.type !== "file" || !event.target.files.length) return;
  words.hidden = event.target.files[0].size <= +words.dataset.largest;
  if (words.hidden) return;
  event.stopImmediatePropagation();
  event.target.value = "";
}, true);

// A finger belongs to the drawing as soon as it is down, which viser takes for a handle that is being dragged: a tap would be no click.
addEventListener("pointerdown", (event) => {
  if (event.target.tagName === "CANVAS" && event.target.hasPointerCapture(event.pointerId)) event.target.releasePointerCapture(event.pointerId);
}, true);

// Keys that move a slider, the caret or a list turn the camera too, which listens further out: not while a control has them.
addEventListener("DOMContentLoaded", () => document.body.addEventListener("keydown", (event) => {
  const plain = !event.ctrlKey && !event.metaKey && /^(Arrow.*|[a-zA-Z])$/.test(event.key);
  if (plain && event.target.closest("input, textarea, [role=slider], [role=tab], [role=option]")) event.stopPropagation();
}));

// A part of a picture that stands for a range of values (data-low to data-high) gives it to the text field that it names (data-field) by a click,
// by Enter, or with others by dragging from one to the other.
const fieldOf = (name) => {
  let around = [...document.querySelectorAll("label")].find((each) => each.textContent.trim() === name);
  while (around && !around.querySelector("input")) around = around.parentElement;
  return around?.querySelector("input");
};
const give = (name, low, high) => {
  const input = fieldOf(name);
  if (!input) return;
  const text = low === high ? `${low}` : `${low}, ${high}`;
  const typed = text === input.value ? `${text} ` : text;  // which counts again
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, typed);
  input.dispatchEvent(new Event("input", { bubbles: true }));
};
const least = (...parts) => parts.reduce((one, other) => (+other.dataset.low < +one.dataset.low ? other : one)).dataset.low;
const most = (...parts) => parts.reduce((one, other) => (+other.dataset.high > +one.dataset.high ? other : one)).dataset.high;
const DRAGGED = 4;  // a pointer that has moved less means where it began, for the picture may have changed under it [pixel]
let pressed = null, from = [0, 0];
addEventListener("pointerdown", (event) => {
  pressed = event.target.closest?.("[data-field]");
  from = [event.clientX, event.clientY];
  if (pressed) event.preventDefault();
});
addEventListener("pointerup", (event) => {
  const begin = pressed, isDragged = Math.hypot(event.clientX - from[0], event.clientY - from[1]) > DRAGGED;
  const end = isDragged ? event.target.closest?.("[data-field]") : begin;
  pressed = null;
  if (begin && end?.dataset.field === begin.dataset.field) give(begin.dataset.field, least(begin, end), most(begin, end));
});
addEventListener("keydown", (event) => {
  const part = event.target.closest?.("[data-field]");
  if (!part || !["Enter", " "].includes(event.key)) return;
  event.preventDefault();
  give(part.dataset.field, part.dataset.low, part.dataset.high);
});

// The server is told which tabs are seen, in a text field that is not: what a click on the drawing does ends with its tab.
const tellTabs = () => {
  const open = [...document.querySelectorAll("[role=tab][aria-selected=true]")].map((each) => each.textContent.trim()).join(",");
  if (open !== fieldOf("open tabs")?.value) give("open tabs", open, open);
};
addEventListener("DOMContentLoaded", () =>
  new MutationObserver(tellTabs).observe(document.body, { subtree: true, attributes: true, attributeFilter: ["aria-selected"] }));

// The time of what runs goes on from second to second, whatever the server is busy with; what it says anew counts.
setInterval(() => {
  for (const each of document.querySelectorAll("[data-seconds]")) {
    each.dataset.since ??= performance.now();
    const seconds = Math.floor(Number(each.dataset.seconds) + (performance.now() - Number(each.dataset.since)) / 1000);
    if (seconds) each.textContent = `${seconds} s`;
  }
}, 1000);
