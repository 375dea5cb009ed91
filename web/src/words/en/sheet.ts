/** The sheet of shortcuts. */

export const sheet = {
  title: "Keyboard shortcuts",
  all: "All shortcuts",
  or: "or",
  pointer: "Mouse and fingers",
  pointers: [
    ["Drag a handle", "Move it in the plane of the view"],
    ["Drag beside", "Turn the view"],
    ["Right, middle or Shift+drag", "Move the view"],
    ["Wheel, pinch", "Zoom to the pointer"],
    ["Shift+click", "Add to the selection, or take away"],
    ["Ctrl+drag beside", "Select by a box"],
    ["Alt+left, middle, right", "Turn, move, zoom, as in Maya"],
    ["One finger, two fingers", "Turn or drag a handle; move and zoom"],
  ],
};
