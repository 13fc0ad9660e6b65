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

// Keys that move a slider, the caret or a list turn the camera too, which listens further out: not while a control has them.
addEventListener("DOMContentLoaded", () => document.body.addEventListener("keydown", (event) => {
  const plain = !event.ctrlKey && !event.metaKey && /^(Arrow.*|[a-zA-Z])$/.test(event.key);
  if (plain && event.target.closest("input, textarea, [role=slider], [role=tab], [role=option]")) event.stopPropagation();
}));
