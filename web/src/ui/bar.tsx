/** The top bar: product name, the five steps, and global actions. */

import type { App } from "../app";
import { type AppState, STEPS, type StepName } from "../state";
import type { Theme } from "../store";
import { T } from "../words";
import { IconButton } from "./controls";
import { Icon, Mark } from "./icons";

const NEXT_THEME: Record<Theme, Theme> = { auto: "dark", dark: "light", light: "auto" };
const THEME_ICON = { auto: "auto", dark: "moon", light: "sun" } as const;

export function Bar({ app, showSheet }: { app: App; showSheet: () => void }) {
  const state = app.store.get();
  const { model, theme } = state;
  return (
    <>
      <div class="brand">
        <Mark />
        <h1>{T.product}</h1>
        <span class="doc">{model?.name}</span>
      </div>
      <nav class="steps" aria-label={T.bar.steps}>
        <ol>
          {STEPS.map((name, index) => (
            <li key={name}>
              <Step app={app} name={name} number={index + 1} />
            </li>
          ))}
        </ol>
      </nav>
      <div class="bar-actions">
        {(["undo", "redo"] as const).map((way) => (
          <IconButton
            key={way}
            icon={way}
            label={T.bar[way]}
            tip={T.bar[`${way}Of`](state[way])}
            {...app.command(way)}
            disabled={state[way] === null}
          />
        ))}
        <span class="gap" />
        <IconButton icon="tour" label={T.tour.begin} {...app.command("tour")} />
        <IconButton icon="share" label={T.bar.share} onClick={() => void app.exports.share()} />
        <IconButton
          icon={THEME_ICON[theme]}
          label={T.bar.theme[theme]}
          onClick={() => app.view.theme(NEXT_THEME[theme])}
        />
        <IconButton icon="help" label={T.bar.sheet} shortcut="?" kind="wide-only" onClick={showSheet} />
      </div>
    </>
  );
}

function Step({ app, name, number }: { app: App; name: StepName; number: number }) {
  const state = app.store.get();
  const { done, turn = null } = PROGRESS[name](state);
  const isHere = state.step === name;
  const isDone = turn === null && done;
  return (
    <button
      type="button"
      class="step"
      data-step={name}
      data-done={isDone && !isHere ? "" : undefined}
      data-busy={turn === null ? undefined : ""}
      aria-current={isHere ? "step" : undefined}
      onClick={() => app.go(name)}
    >
      <span class="dot" aria-hidden="true" style={turn === null ? undefined : { "--turn": `${100 * turn}%` }}>
        {isDone && !isHere ? <Icon name="check" /> : number}
      </span>
      <span>{T.bar.names[name]}</span>
      <span class="visually-hidden">{turn !== null ? T.bar.running : isDone ? T.bar.done : ""}</span>
    </button>
  );
}

/** Whether a step is done, and the finished fraction of its operation in progress. */
const PROGRESS: Record<StepName, (state: AppState) => { done: boolean; turn?: number | null | undefined }> = {
  model: ({ model }) => ({ done: model !== null }),
  cage: ({ cage, cageProgress }) => ({ done: cage?.usable === true, turn: cageProgress }),
  bind: ({ bound, bindRun }) => ({ done: bound, turn: bindRun?.fraction }),
  pose: ({ poses }) => ({ done: poses.length > 0 }),
  export: () => ({ done: false }),
};
