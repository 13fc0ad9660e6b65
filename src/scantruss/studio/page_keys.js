// What the page lacks for those who use keys alone: heads of folders that can be reached, names of controls, and a cross on the drawing that clicks.

const NAMES = { "mantine-Notification-closeButton": "Close", "tabler-icon-list-search": "Commands", "tabler-icon-adjustments": "Diagnostics",
  "tabler-icon-arrow-back": "Back" };
const ROOM_FOR_HINT = 270;  // beside the panel, that its words need [pixel]
const CROSS_STEP = 10;  // of an arrow key; with Alt held a tenth of it [pixel]

const isOpen = (head) => head.nextElementSibling?.getAttribute("aria-hidden") !== "true";
const labelOf = (control) => {
  let around = control;
  while (around && !around.querySelector("label")) around = around.parentElement;
  return around?.querySelector("label").textContent.trim() ?? "";
};
const complete = () => {
  for (const head of document.querySelectorAll("[data-with-border] > .mantine-Paper-root:first-child")) {
    head.tabIndex = 0;
    head.setAttribute("role", "button");
    head.setAttribute("aria-expanded", isOpen(head));
  }
  for (const [mark, name] of Object.entries(NAMES))
    for (const each of document.querySelectorAll(`.${mark}`)) (each.closest("button") ?? each).setAttribute("aria-label", name);
  for (const each of document.querySelectorAll("[role=slider][aria-label=''], [role=slider]:not([aria-label]), input:not([aria-label])"))
    if (!each.labels?.length) each.setAttribute("aria-label", labelOf(each));
  const hints = JSON.parse(document.querySelector("[data-hints]")?.dataset.hints ?? "{}");
  for (const each of document.querySelectorAll("button[data-size=compact-xs]:not([title])")) {
    const words = hints[labelOf(each)]?.[each.textContent.trim()];
    if (words) each.title = words;  // which come after the first of the rows
  }
  if (document.querySelector(".mantine-Tooltip-tooltip")) {  // beside the panel, where it covers no control (`style.py`)
    const left = document.querySelector(".studio-head")?.getBoundingClientRect().left ?? 0;
    document.documentElement.style.setProperty("--studio-panel", `${left}px`);
    document.documentElement.toggleAttribute("data-hints-aside", left > ROOM_FOR_HINT);
  }
  const drawing = drawn();
  if (drawing && !drawing.hasAttribute("tabindex")) prepare(drawing);
};
addEventListener("keydown", (event) => {
  const head = event.target.closest?.("[data-with-border] > [role=button]");
  if (!head || event.target !== head || !["Enter", " "].includes(event.key)) return;
  event.preventDefault();
  head.click();
});

// ---- the cross: arrows move it, Enter clicks where it is, space presses there and lets go where it is then; Shift held counts as with a pointer.

const drawn = () => document.querySelector("canvas[data-engine]");
const cross = document.createElement("div");
cross.hidden = true;
cross.setAttribute("aria-hidden", "true");
cross.style.cssText = "position:fixed;width:25px;height:25px;margin:-12px 0 0 -12px;pointer-events:none;z-index:5;mix-blend-mode:difference;"
  + "background:linear-gradient(#fff,#fff) 50%/3px 100% no-repeat,linear-gradient(#fff,#fff) 50%/100% 3px no-repeat";
let share = [0.5, 0.5], pressed = null;  // where the cross is over the drawing, and with Shift or without where a press began

const show = () => {
  const box = drawn().getBoundingClientRect();
  cross.style.left = `${box.left + share[0] * box.width}px`;
  cross.style.top = `${box.top + share[1] * box.height}px`;
};
const tell = (kind, shiftKey, buttons) => {
  const box = drawn().getBoundingClientRect();
  drawn().dispatchEvent(new PointerEvent(kind, {
    bubbles: true, cancelable: true, composed: true, pointerId: 1, pointerType: "mouse", isPrimary: true, shiftKey, buttons,
    button: kind === "pointermove" ? -1 : 0, clientX: box.left + share[0] * box.width, clientY: box.top + share[1] * box.height,
  }));
};
const release = () => {
  if (pressed) tell("pointerup", pressed.shiftKey, 0);
  pressed = null;
};
const KEYS = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
};
const move = ([right, down], step) => {
  const box = drawn().getBoundingClientRect();
  const within = (value) => Math.min(Math.max(value, 0), 1);
  share = [within(share[0] + (right * step) / box.width), within(share[1] + (down * step) / box.height)];
  show();
  tell("pointermove", pressed?.shiftKey ?? false, pressed ? 1 : 0);
};
const take = (event) => {
  if (cross.hidden || event.ctrlKey || event.metaKey) return;
  if (KEYS[event.key] && (!event.shiftKey || pressed)) move(KEYS[event.key], event.altKey ? CROSS_STEP / 10 : CROSS_STEP);
  else if (event.key === "Enter") {
    release();
    tell("pointermove", event.shiftKey, 0);
    tell("pointerdown", event.shiftKey, 1);
    tell("pointerup", event.shiftKey, 0);
  } else if (event.key === " " && pressed) release();
  else if (event.key === " ") {
    pressed = { shiftKey: event.shiftKey };
    tell("pointermove", event.shiftKey, 0);
    tell("pointerdown", event.shiftKey, 1);
  } else return;
  event.preventDefault();
  event.stopPropagation();
};
const prepare = (drawing) => {
  drawing.tabIndex = 0;
  drawing.setAttribute("role", "application");
  drawing.setAttribute("aria-label", "drawing: arrows move a cross, Enter clicks there, space presses and lets go; with Shift arrows turn the view");
  drawing.addEventListener("focus", () => {
    cross.hidden = !drawing.matches(":focus-visible");
    show();
  });
  drawing.addEventListener("blur", () => {
    release();
    cross.hidden = true;
  });
  drawing.addEventListener("keydown", take);
  drawing.addEventListener("pointerdown", (event) => { if (event.isTrusted) cross.hidden = true; });
};
addEventListener("DOMContentLoaded", () => {
  document.body.append(cross);
  new MutationObserver(complete).observe(document.body, { childList: true, subtree: true, attributes: true, attributeFilter: ["aria-hidden"] });
  complete();
});
