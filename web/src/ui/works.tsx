/** List of the work saved in this browser. */

import { useEffect, useState } from "preact/hooks";
import type { App } from "../app";
import { bytes } from "../format";
import { T } from "../words";
import { ago, KEPT_DAYS, type Work } from "../works/entry";
import { Button } from "./controls";
import { Dialog } from "./dialog";
import { Icon } from "./icons";

export function WorksList({ app }: { app: App }) {
  const { worksOpen, works } = app.store.get();
  const close = () => app.store.set({ worksOpen: false });
  const leave = (then: () => unknown) => {
    close();
    void then();
  };
  useEffect(() => {
    if (!worksOpen) return;
    const refresh = () => void app.works.refresh();
    refresh();
    // While the window had no focus, another tab may have opened, closed or deleted work.
    window.addEventListener("focus", refresh);
    return () => window.removeEventListener("focus", refresh);
  }, [worksOpen]);
  return (
    <Dialog title={T.works.title} isOpen={worksOpen} onClose={close} kind="ways works">
      <div class="sheet-body">
        <ul class="works-list">
          {works.map((work) => (
            <Row
              key={work.id}
              work={work}
              open={() => leave(() => app.works.open(work))}
              remove={() => void app.works.remove(work.id)}
            />
          ))}
          {works.length === 0 && <li class="hint">{T.works.none}</li>}
        </ul>
        <p class="hint">{T.works.about(KEPT_DAYS)}</p>
        <div class="row wrap">
          <Button label={T.panel.open} onClick={() => leave(app.chooseModel)} icon="file" kind="" />
          <Button label={T.works.sample} onClick={() => leave(app.startFresh)} kind="" />
        </div>
      </div>
    </Dialog>
  );
}

function Row({ work, open, remove }: { work: Work; open: () => void; remove: () => void }) {
  const { name, when, size, where, stopped } = work;
  const about = [ago(Date.now() - when), bytes(size), T.works.where[where]].filter(Boolean).join(" · ");
  const opens = where === "elsewhere" ? T.works.openCopy : T.works.open;
  return (
    <li class="work">
      <span class="tile">
        <Icon name="model" />
      </span>
      <div class="grow work-about">
        <strong class="clip">{name}</strong>
        <p class="hint">{about}</p>
        {stopped && <p class="hint">{T.works.stopped}</p>}
      </div>
      <div class="row">
        {where !== "here" && <Button label={opens} name={`${opens} ${name}`} onClick={open} />}
        {where !== "elsewhere" && <Delete name={name} remove={remove} />}
      </div>
    </li>
  );
}

/** Button that deletes work. It needs two clicks, because deleting cannot be undone. */
function Delete({ name, remove }: { name: string; remove: () => void }) {
  const [isSure, setSure] = useState(false);
  const label = isSure ? T.works.reallyDelete : T.works.delete;
  return (
    <span onFocusOut={() => setSure(false)}>
      <Button
        label={label}
        name={`${label} ${name}`}
        onClick={isSure ? remove : () => setSure(true)}
        kind={isSure ? "small danger" : "small"}
      />
    </span>
  );
}
