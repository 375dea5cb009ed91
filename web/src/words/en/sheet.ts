/** The shortcut sheet. */

export const sheet = {
  title: "Keyboard shortcuts",
  all: "All shortcuts",
  or: "or",
  pointer: "Mouse and fingers",
  pointers: [
    ["Drag a handle", "Move it in the plane of the view"],
    ["Drag the background", "Turn the view"],
    ["Right, middle or Shift+drag", "Move the view"],
    ["Wheel, pinch", "Zoom at the pointer"],
    ["Shift+click", "Add to the selection, or remove from it"],
    ["Ctrl+drag the background", "Select with a box"],
    ["Alt+left, middle, right", "Turn, move, zoom as in Maya"],
    ["One finger; two fingers", "Turn the view or drag a handle; move and zoom"],
  ],
};
