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
