/** The page's form controls: labelled and usable from the keyboard. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import { createDraft, type Entry, type NumberRange, numberIn } from "../draft";
import { percent } from "../format";
import { type Message, textOf } from "../strings";
import { T } from "../words";
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

type PlainProps = ButtonProps & { children?: ComponentChildren };

function PlainButton(props: PlainProps) {
  const { label, onClick, icon, kind = "", tip, name, pressed, children, ...rest } = props;
  /** The button at the press of a pointer. If it is drawn with another label before the release, this is what runs. */
  const press = useRef<{ label: string; onClick: () => void } | undefined>(undefined);
  return (
    <button
      {...rest}
      type="button"
      onPointerDown={() => {
        press.current = { label, onClick };
      }}
      onKeyDown={() => {
        press.current = undefined;
      }}
      onClick={() => {
        const { current } = press;
        press.current = undefined;
        (current && current.label !== label ? current.onClick : onClick)();
      }}
      class={kind.trim()}
      aria-label={name}
      aria-pressed={pressed}
      data-tip={tip}
    >
      {icon && <Icon name={icon} />}
      {children}
    </button>
  );
}

/** Button with text and an optional icon. It is small unless `kind` says otherwise. */
export function Button({ label, kind = "small", ...rest }: ButtonProps) {
  return (
    <PlainButton {...rest} label={label} kind={`button ${kind}`}>
      <span>{label}</span>
    </PlainButton>
  );
}

interface IconButtonProps extends Omit<ButtonProps, "icon" | "name"> {
  icon: IconName;
  shortcut?: string;
}

/** Button with only an icon. `label` is its accessible name and, with the shortcut, its tool tip. */
export function IconButton({ label, shortcut, kind = "", tip = label, ...rest }: IconButtonProps) {
  const whole = shortcut ? `${tip} (${shortcut})` : tip;
  return <PlainButton {...rest} label={label} kind={`icon-button ${kind}`} name={label} tip={whole} />;
}

let next = 0;

/** An id that is unique on the page, to connect a label with its input. */
export function useUid(): string {
  return useState(() => `control-${++next}`)[0];
}

/** The value that a control shows, and what happens when the user changes it. */
interface Field<T> {
  value: T;
  onChange: (value: T) => void;
}

/** Connects controls to the keys of an object: `{...option("grid")}` shows `object.grid` and passes changes to `set`. */
export function fieldsOf<T extends object>(object: T, set: (patch: Partial<T>) => unknown) {
  return <K extends keyof T>(key: K): Field<T[K]> => ({
    value: object[key],
    onChange: (value) => void set({ [key]: value } as unknown as Partial<T>),
  });
}

/** Connects a switch to a field. The switch sets it to `on` or `off`, and is off only if the value is `off`. */
export function switchOf<T>({ value, onChange }: Field<T>, on: T, off: T): Field<boolean> {
  return { value: value !== off, onChange: (isOn) => onChange(isOn ? on : off) };
}

interface SegmentsProps<T extends string | number> extends Field<T> {
  label: string;
  /** Tool tip of the label. */
  tip?: string;
  hideLabel?: boolean;
  /** The label of each value. A record also determines which values are offered, and their order. */
  labels: Readonly<Partial<Record<T, string>>> | ((value: T) => string);
  values?: readonly T[];
  tips?: Readonly<Partial<Record<T, string>>>;
  /** Values that cannot be chosen now. */
  disabled?: readonly T[];
}

/** A choice of one of a few values: radio buttons drawn as segments of a bar. */
export function Segments<T extends string | number>(props: SegmentsProps<T>) {
  const {
    label,
    tip,
    hideLabel,
    labels,
    values = Object.keys(labels) as T[],
    tips,
    disabled,
    ...field
  } = props;
  const name = useUid();
  return (
    <fieldset class="field">
      <legend class={hideLabel ? "visually-hidden" : "legend-text"} data-tip={tip}>
        {label}
      </legend>
      <div class="segments">
        {values.map((value) => (
          <label key={value} data-tip={tips?.[value]}>
            <input
              type="radio"
              name={name}
              value={value}
              checked={value === field.value}
              disabled={disabled?.includes(value)}
              onChange={() => field.onChange(value)}
            />
            <span>{typeof labels === "function" ? labels(value) : labels[value]}</span>
          </label>
        ))}
      </div>
    </fieldset>
  );
}

interface SelectProps<T extends string | number> extends Field<T | null> {
  label: string;
  hideLabel?: boolean;
  /** Label of the choice that stands for null. */
  none: string;
  options: readonly (readonly [value: T, label: string])[];
  /** Accessible name, where the label alone is ambiguous. */
  name?: string;
  disabled?: boolean;
  /** Class names from controls.css. */
  kind?: string;
}

/** A list from which the user chooses one value or none. */
export function Select<T extends string | number>(props: SelectProps<T>) {
  const { label, hideLabel, none, options, name, disabled, kind = "stack tight", value, onChange } = props;
  return (
    <label class={kind}>
      <span class={hideLabel ? "visually-hidden" : "legend-text"}>{label}</span>
      <select
        aria-label={name}
        disabled={disabled}
        value={options.find(([one]) => one === value)?.[0] ?? ""}
        onChange={(event) => onChange(options[event.currentTarget.selectedIndex - 1]?.[0] ?? null)}
      >
        <option value="">{none}</option>
        {options.map(([value, label]) => (
          <option key={value} value={value}>
            {label}
          </option>
        ))}
      </select>
    </label>
  );
}

/** A switch with a label. `sentence`: an explanation, shown as a tool tip. */
export function Toggle(props: Field<boolean> & { label: string; sentence?: string }) {
  const id = useUid();
  const { label, sentence, value, onChange } = props;
  return (
    <label class="switch" for={id} data-tip={sentence || undefined}>
      <span class="text">{label}</span>
      <input
        type="checkbox"
        role="switch"
        id={id}
        aria-checked={value}
        aria-description={sentence || undefined}
        checked={value}
        onChange={(event) => onChange(event.currentTarget.checked)}
      />
    </label>
  );
}

interface SliderProps extends Field<number> {
  label: string;
  min: number;
  max: number;
  step: number;
  /** Called on release, after the last `onChange`. */
  onCommit?: (value: number) => void;
  /** Formats the value for the display and for screen readers. */
  format?: (value: number) => string;
  name?: string;
  /** Values that a band below the slider marks as usual. */
  usual?: readonly [from: number, to: number];
  /** Values beyond which the band marks that something is wrong. */
  limits?: { readonly min: number; readonly max: number };
  /** Called on a double click. */
  onReset?: () => void;
  /** Tool tip of the label. */
  tip?: string;
  /** Shows the value in a field, in which it can be typed, in percent. */
  typed?: boolean;
}

/** Range and format of a slider for a fraction, 0 to 1, shown in percent. */
export const SHARES = { min: 0, max: 1, step: 0.01, format: percent } as const;

/** A slider with its value next to the label. */
export function Slider(props: SliderProps) {
  const {
    label,
    value,
    onChange,
    onCommit,
    format = String,
    name,
    usual,
    limits,
    onReset,
    tip,
    typed,
    ...range
  } = props;
  const id = useUid();
  const band = usual && {
    "--min": range.min,
    "--max": range.max,
    "--from": usual[0],
    "--to": usual[1],
    "--low": limits?.min ?? range.min,
    "--high": limits?.max ?? range.max,
  };
  return (
    <div class={usual ? "field banded" : "field"} style={band}>
      <label for={id} onDblClick={onReset} data-tip={tip}>
        {label}
        {!typed && <output for={id}>{format(value)}</output>}
      </label>
      {typed && (
        <span class="typed">
          <NumberInput
            name={T.percentOf(label)}
            value={Math.round(100 * value)}
            min={100 * range.min}
            max={100 * range.max}
            onChange={(percents) => {
              onChange(percents / 100);
              onCommit?.(percents / 100);
            }}
          />
          <span aria-hidden="true">%</span>
        </span>
      )}
      <input
        {...range}
        type="range"
        id={id}
        value={value}
        aria-label={name}
        aria-valuetext={format(value)}
        onDblClick={onReset}
        onInput={(event) => onChange(event.currentTarget.valueAsNumber)}
        onChange={(event) => onCommit?.(event.currentTarget.valueAsNumber)}
      />
    </div>
  );
}

interface TextEntryProps<T> extends Entry<T> {
  /** Whether long text wraps. */
  wraps?: boolean;
  name?: string | undefined;
  /** Further attributes of the element. */
  attributes?: Readonly<Record<string, string | number | undefined>>;
}

/**
 * The one field for typed text and numbers. It commits on Enter, when it loses the focus, on the steps of a number
 * field, and before any other action. Escape drops what was typed.
 */
export function TextEntry<T>({ text, parse, onCommit, wraps, name, attributes }: TextEntryProps<T>) {
  const element = useRef<HTMLInputElement & HTMLTextAreaElement>(null);
  const [draft] = useState(() => createDraft<T>());
  const [, drawAgain] = useState({});
  useLayoutEffect(() => {
    if (!element.current) return;
    draft.update(element.current, { text, parse, onCommit });
    element.current.ariaInvalid = String(draft.isMalformed());
  });
  useLayoutEffect(() => draft.commit, []);
  const commit = () => {
    draft.commit();
    drawAgain({});
  };
  const Element = wraps ? "textarea" : "input";
  return (
    <Element
      {...attributes}
      ref={element}
      aria-label={name}
      onInput={draft.type}
      onChange={commit}
      onBlur={commit}
      onKeyDown={(event: KeyboardEvent) => {
        const ends = event.key === "Enter" || event.key === "Escape";
        if (!ends || event.isComposing || event.ctrlKey || event.metaKey) return;
        event.preventDefault();
        if (event.key === "Escape") draft.drop();
        element.current?.blur();
      }}
    />
  );
}

interface NumberInputProps extends NumberRange {
  id?: string;
  name?: string;
  value: number | string;
  /** Returns false if the number is refused. */
  onChange: (value: number) => unknown;
}

/** Number field. `onChange` gets numbers of the range. Other text stays in the field, marked as invalid. */
export function NumberInput({ name, value, onChange, id, step, min, max }: NumberInputProps) {
  const parse = (text: string) => numberIn(text, { min, max, step });
  const attributes = { id, type: "number", inputMode: "decimal", step: step ?? "any", min, max };
  return (
    <TextEntry name={name} text={String(value)} parse={parse} onCommit={onChange} attributes={attributes} />
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

/** A table of names and values. Rows without a value are left out. */
export function Facts({ rows }: { rows: readonly (readonly [name: string, value: string | false])[] }) {
  const shown = rows.filter(([, value]) => value);
  return (
    <dl class="facts">
      {shown.flatMap(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name} is`}>{value}</dd>])}
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
export function Head({ title, sentence }: { title: string; sentence?: string }) {
  return (
    <div class="head">
      <h2>{title}</h2>
      {sentence && <p class="hint">{sentence}</p>}
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

/** Collapsible section. `open`: whether it is open at first. */
export function Fold(props: { title: string; children: ComponentChildren; open?: boolean }) {
  const { title, children, open } = props;
  return (
    <details class="fold" open={open}>
      <summary>{title}</summary>
      <div class="stack">{children}</div>
    </details>
  );
}
