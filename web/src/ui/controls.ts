/** The page's controls: labelled, keyboard-ready, each a function that returns an element and how to update it. */

import { h, setText } from "./dom";
import { type IconName, icon } from "./icons";

/** A button with text and perhaps an icon. `kind` are class names of controls.css. */
export function button(
  label: string,
  onClick: () => void,
  options: { icon?: IconName; kind?: string; title?: string; id?: string } = {},
): HTMLButtonElement {
  return h(
    "button",
    {
      class: `button ${options.kind ?? ""}`.trim(),
      attrs: { type: "button" },
      on: { click: onClick },
      ...(options.title === undefined ? {} : { title: options.title }),
      ...(options.id === undefined ? {} : { id: options.id }),
    },
    options.icon ? icon(options.icon) : null,
    h("span", { text: label }),
  );
}

/** A button that shows only an icon; `label` is its name, and its tool tip with the shortcut. */
export function iconButton(
  name: IconName,
  label: string,
  onClick: () => void,
  options: { shortcut?: string; kind?: string; pressed?: boolean } = {},
): HTMLButtonElement {
  return h(
    "button",
    {
      class: `icon-button ${options.kind ?? ""}`.trim(),
      title: options.shortcut ? `${label} (${options.shortcut})` : label,
      attrs: {
        type: "button",
        "aria-label": label,
        ...(options.pressed === undefined ? {} : { "aria-pressed": String(options.pressed) }),
      },
      on: { click: onClick },
    },
    icon(name),
  );
}

/** Sets a toggle button. */
export function press(element: HTMLElement, on: boolean): void {
  element.setAttribute("aria-pressed", String(on));
}

let next = 0;

/** A fresh id for label and input. */
export function uid(prefix: string): string {
  next += 1;
  return `${prefix}-${next}`;
}

export interface Control<T> {
  element: HTMLElement;
  set(value: T): void;
}

/** One of a few choices, side by side: radio buttons that look like segments. */
export function segments<T extends string>(
  label: string,
  choices: readonly { value: T; label: string; title?: string }[],
  onChange: (value: T) => void,
  options: { hideLabel?: boolean } = {},
): Control<T> & { enable(value: T, on: boolean): void } {
  const name = uid("segment");
  const inputs = new Map<T, HTMLInputElement>();
  const row = h("div", { class: "segments" });
  for (const choice of choices) {
    const input = h("input", {
      attrs: { type: "radio", name, value: choice.value },
      on: { change: () => onChange(choice.value) },
    });
    inputs.set(choice.value, input);
    const props = choice.title === undefined ? {} : { title: choice.title };
    row.append(h("label", props, input, h("span", { text: choice.label })));
  }
  const legend = h("legend", {
    class: options.hideLabel ? "visually-hidden" : "legend-text",
    text: label,
  });
  const element = h("fieldset", { class: "field" }, legend, row);
  return {
    element,
    set(value) {
      const input = inputs.get(value);
      if (input && !input.checked) input.checked = true;
    },
    enable(value, on) {
      const input = inputs.get(value);
      if (input) input.disabled = !on;
    },
  };
}

/** A switch with a name and a sentence. */
export function toggle(label: string, sentence: string, onChange: (on: boolean) => void): Control<boolean> {
  const id = uid("switch");
  const input = h("input", {
    attrs: { type: "checkbox", role: "switch", id, ...(sentence ? { "aria-describedby": `${id}-s` } : {}) },
    on: { change: () => onChange(input.checked) },
  });
  const element = h(
    "label",
    { class: "switch", attrs: { for: id } },
    h(
      "span",
      { class: "text" },
      h("span", { text: label }),
      sentence ? h("small", { id: `${id}-s`, text: sentence }) : null,
    ),
    input,
  );
  return {
    element,
    set(on) {
      if (input.checked !== on) input.checked = on;
    },
  };
}

export interface SliderOptions {
  min: number;
  max: number;
  step: number;
  /** How the value is shown and spoken. */
  format?: (value: number) => string;
  /** Called when the finger is lifted, after the last `onInput`. */
  onCommit?: (value: number) => void;
}

/** A slider with its value beside its name. */
export function slider(
  label: string,
  options: SliderOptions,
  onInput: (value: number) => void,
): Control<number> & { input: HTMLInputElement } {
  const id = uid("slider");
  const format = options.format ?? String;
  const output = h("output", { attrs: { for: id } });
  const input = h("input", {
    attrs: {
      type: "range",
      id,
      min: String(options.min),
      max: String(options.max),
      step: String(options.step),
    },
  });
  const show = () => {
    const text = format(input.valueAsNumber);
    setText(output, text);
    input.setAttribute("aria-valuetext", text);
  };
  input.addEventListener("input", () => {
    show();
    onInput(input.valueAsNumber);
  });
  input.addEventListener("change", () => options.onCommit?.(input.valueAsNumber));
  show();
  return {
    element: h("div", { class: "field" }, h("label", { attrs: { for: id } }, label, output), input),
    input,
    set(value) {
      if (input.valueAsNumber !== value) {
        input.value = String(value);
        show();
      }
    },
  };
}

/** A number that is typed; `onCommit` hears it on Enter or when the field is left, and only when it is valid. */
export function numberField(
  label: string,
  options: { min?: number; max?: number; step?: string; hint?: string },
  onCommit: (value: number) => void,
): Control<number> & { input: HTMLInputElement } {
  const id = uid("number");
  const input = h("input", {
    attrs: {
      type: "number",
      id,
      step: options.step ?? "any",
      inputmode: "decimal",
      ...(options.min === undefined ? {} : { min: String(options.min) }),
      ...(options.max === undefined ? {} : { max: String(options.max) }),
    },
  });
  input.addEventListener("change", () => {
    const valid = input.value !== "" && input.validity.valid;
    input.setAttribute("aria-invalid", String(!valid));
    if (valid) onCommit(input.valueAsNumber);
  });
  return {
    element: h(
      "div",
      { class: "field" },
      h("label", { attrs: { for: id }, text: label }),
      input,
      options.hint ? h("p", { class: "hint", text: options.hint }) : null,
    ),
    input,
    set(value) {
      if (document.activeElement !== input && input.valueAsNumber !== value) input.value = String(value);
    },
  };
}

/** Name and value pairs. */
export function facts(rows: readonly (readonly [string, string])[]): HTMLElement {
  const list = h("dl", { class: "facts" });
  for (const [name, value] of rows) list.append(h("dt", { text: name }), h("dd", { text: value }));
  return list;
}

/** A group with a heading. */
export function section(title: string, ...children: (Node | null)[]): HTMLElement {
  return h("section", { class: "section" }, h("h3", { text: title }), ...children);
}

/** A panel's heading and the sentence under it. */
export function head(title: string, sentence: string): HTMLElement {
  return h("div", { class: "head" }, h("h2", { text: title }), h("p", { class: "hint", text: sentence }));
}
