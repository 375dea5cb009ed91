/** The page's form controls: labelled and usable from the keyboard. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { percent } from "../format";
import { type Message, textOf } from "../strings";
import { Icon, type IconName } from "./icons";

/** A message. English text in a page of another language is marked for screen readers. */
export function Say({ text, kind }: { text: Message; kind?: string }) {
  return (
    <p class={kind} lang={typeof text === "string" ? undefined : "en"}>
      {textOf(text)}
    </p>
  );
}

interface ButtonProps {
  label: string;
  onClick: () => void;
  icon?: IconName | undefined;
  /** Class names from controls.css. */
  kind?: string;
  /** Tool tip, see tips.ts. */
  tip?: string | undefined;
  /** Accessible name, where the label alone is ambiguous. */
  name?: string;
  disabled?: boolean;
  pressed?: boolean;
}

/** Button with text and an optional icon. */
export function Button({ label, icon, kind = "", tip, name, pressed, ...rest }: ButtonProps) {
  return (
    <button
      {...rest}
      type="button"
      class={`button ${kind}`.trim()}
      aria-label={name}
      aria-pressed={pressed}
      data-tip={tip}
    >
      {icon && <Icon name={icon} />}
      <span>{label}</span>
    </button>
  );
}

interface IconButtonProps extends Omit<ButtonProps, "icon" | "name"> {
  icon: IconName;
  shortcut?: string;
}

/** Button with only an icon. `label` is its accessible name and, with the shortcut, its tool tip. */
export function IconButton(props: IconButtonProps) {
  const { icon, label, shortcut, kind = "", tip = label, pressed, ...rest } = props;
  return (
    <button
      {...rest}
      type="button"
      class={`icon-button ${kind}`.trim()}
      aria-label={label}
      aria-pressed={pressed}
      data-tip={shortcut ? `${tip} (${shortcut})` : tip}
    >
      <Icon name={icon} />
    </button>
  );
}

let next = 0;

/** An id that is unique on the page, to connect a label with its input. */
export function useUid(): string {
  return useState(() => `control-${++next}`)[0];
}

export interface Choice<T extends string> {
  value: T;
  label: string;
  tip?: string | undefined;
  disabled?: boolean;
}

/** Choices for `values`, with the label and tool tip of each value. */
export function choicesOf<T extends string>(
  values: readonly T[],
  labels: Readonly<Record<T, string>>,
  tips?: Readonly<Partial<Record<T, string>>>,
): Choice<T>[] {
  return values.map((value) => ({ value, label: labels[value], tip: tips?.[value] }));
}

interface SegmentsProps<T extends string> {
  label: string;
  choices: readonly Choice<T>[];
  value: T;
  onChange: (value: T) => void;
  hideLabel?: boolean;
}

/** A choice of one of a few values: radio buttons drawn as segments of a bar. */
export function Segments<T extends string>({ label, choices, value, onChange, hideLabel }: SegmentsProps<T>) {
  const name = useUid();
  return (
    <fieldset class="field">
      <legend class={hideLabel ? "visually-hidden" : "legend-text"}>{label}</legend>
      <div class="segments">
        {choices.map((choice) => (
          <label key={choice.value} data-tip={choice.tip}>
            <input
              type="radio"
              name={name}
              value={choice.value}
              checked={choice.value === value}
              disabled={choice.disabled}
              onChange={() => onChange(choice.value)}
            />
            <span>{choice.label}</span>
          </label>
        ))}
      </div>
    </fieldset>
  );
}

/** A switch with a label and an explanation. */
export function Toggle(props: {
  label: string;
  sentence?: string;
  on: boolean;
  onChange: (on: boolean) => void;
}) {
  const id = useUid();
  const { label, sentence, on, onChange } = props;
  return (
    <label class="switch" for={id}>
      <span class="text">
        <span>{label}</span>
        {sentence && <small id={`${id}-s`}>{sentence}</small>}
      </span>
      <input
        type="checkbox"
        role="switch"
        id={id}
        aria-checked={on}
        aria-describedby={sentence ? `${id}-s` : undefined}
        checked={on}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
    </label>
  );
}

interface SliderProps {
  label: string;
  min: number;
  max: number;
  step: number;
  value: number;
  onInput: (value: number) => void;
  /** Called on release, after the last `onInput`. */
  onCommit?: (value: number) => void;
  /** Formats the value for the display and for screen readers. */
  format?: (value: number) => string;
  name?: string;
}

/** Range and format of a slider for a fraction, 0 to 1, shown in percent. */
export const SHARES = { min: 0, max: 1, step: 0.01, format: percent } as const;

/** A slider with its value next to the label. */
export function Slider(props: SliderProps) {
  const { label, value, onInput, onCommit, format = String, name, ...range } = props;
  const id = useUid();
  return (
    <div class="field">
      <label for={id}>
        {label}
        <output for={id}>{format(value)}</output>
      </label>
      <input
        {...range}
        type="range"
        id={id}
        value={value}
        aria-label={name}
        aria-valuetext={format(value)}
        onInput={(event) => onInput(event.currentTarget.valueAsNumber)}
        onChange={(event) => onCommit?.(event.currentTarget.valueAsNumber)}
      />
    </div>
  );
}

interface NumberInputProps {
  id?: string;
  name?: string;
  value: number | string;
  onCommit: (value: number) => void;
  min?: number;
  max?: number;
  step?: string;
}

/** Number field. Calls `onCommit` when the user presses Enter or leaves the field, if the number is valid. */
export function NumberInput({ name, value, onCommit, ...rest }: NumberInputProps) {
  const input = useRef<HTMLInputElement>(null);
  /** Whether the user has typed something that is not committed. The field is not overwritten then. */
  const isTyping = useRef(false);
  useLayoutEffect(() => {
    if (input.current && !isTyping.current) input.current.value = String(value);
  }, [value]);
  return (
    <input
      step="any"
      {...rest}
      ref={input}
      type="number"
      aria-label={name}
      inputMode="decimal"
      onInput={() => {
        isTyping.current = true;
      }}
      onBlur={() => {
        isTyping.current = false;
      }}
      onChange={(event) => {
        isTyping.current = false;
        const { currentTarget: field } = event;
        const isValid = field.value !== "" && field.validity.valid;
        field.setAttribute("aria-invalid", String(!isValid));
        if (isValid) onCommit(field.valueAsNumber);
      }}
    />
  );
}

export function NumberField({ label, ...props }: Omit<NumberInputProps, "id" | "name"> & { label: string }) {
  const id = useUid();
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <NumberInput id={id} {...props} />
    </div>
  );
}

export function Facts({ rows }: { rows: readonly (readonly [name: string, value: string])[] }) {
  return (
    <dl class="facts">
      {rows.flatMap(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name} is`}>{value}</dd>])}
    </dl>
  );
}

export function Section({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <section class="section">
      <h3>{title}</h3>
      {children}
    </section>
  );
}

/** Heading of a panel, with a sentence below it. */
export function Head({ title, sentence }: { title: string; sentence: string }) {
  return (
    <div class="head">
      <h2>{title}</h2>
      <p class="hint">{sentence}</p>
    </div>
  );
}

/** Short label with an icon, coloured by its kind. */
export function Badge({ kind, icon, text }: { kind: "good" | "warn" | "bad"; icon: IconName; text: string }) {
  return (
    <span class={`badge ${kind}`}>
      <Icon name={icon} />
      {text}
    </span>
  );
}

/** Collapsible section. */
export function Fold({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <details class="fold">
      <summary>{title}</summary>
      <div class="stack">{children}</div>
    </details>
  );
}
