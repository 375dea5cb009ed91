/** The list of work that this browser keeps. */

import type { App } from "../app";
import { bytes } from "../format";
import { ago, KEPT_DAYS, type Work } from "../works/entry";
import { button, iconButton } from "./controls";
import { fill, h } from "./dom";
import { icon } from "./icons";

const WHERE: Record<Work["where"], string> = {
  here: "open here",
  elsewhere: "open in another tab",
  nowhere: "",
};

export function createWorksList(app: App): HTMLDialogElement {
  const { store, works } = app;
  const list = h("ul", { class: "works-list" });
  const close = () => dialog.close();
  const dialog = h(
    "dialog",
    { class: "sheet ways works", attrs: { "aria-labelledby": "works-title" } },
    h(
      "div",
      { class: "row sheet-head" },
      h("h2", { class: "grow", id: "works-title", text: "Kept in this browser" }),
      iconButton("close", "Close", close),
    ),
    h(
      "div",
      { class: "sheet-body" },
      list,
      h("p", {
        class: "hint",
        text: `Work is kept by itself as you go, for ${KEPT_DAYS} days after its last change, on this computer only.`,
      }),
      h(
        "div",
        { class: "row wrap" },
        button("Open a file", () => leave(() => app.chooseModel()), { icon: "file" }),
        button("Start with a sample", () => leave(() => app.startFresh())),
      ),
    ),
  );
  const leave = (then: () => unknown) => {
    close();
    void then();
  };
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) close();
  });
  dialog.addEventListener("close", () => store.set({ worksOpen: false }));
  // Another tab may have opened, closed or deleted some of it.
  window.addEventListener("focus", () => void (dialog.open && works.refresh()));
  store.watch(["worksOpen"], ({ worksOpen }) => {
    if (!worksOpen || dialog.open) return;
    void works.refresh();
    dialog.showModal();
  });
  store.watch(["works"], ({ works: kept }) => {
    const rows = kept.map((work) =>
      row(
        work,
        () => leave(() => works.open(work)),
        () => void works.remove(work.id),
      ),
    );
    fill(list, ...(rows.length > 0 ? rows : [h("li", { class: "hint", text: "There is nothing yet." })]));
  });
  return dialog;
}

function row(work: Work, open: () => void, remove: () => void): HTMLElement {
  const { name, when, size, where, stopped } = work;
  const about = [ago(Date.now() - when), bytes(size), WHERE[where]].filter(Boolean).join(" · ");
  const opens = where === "elsewhere" ? "Open a copy" : "Open";
  const named = (element: HTMLButtonElement, label: string) => {
    element.setAttribute("aria-label", `${label} ${name}`);
    return element;
  };
  /** Deleted work does not come back: the second click counts. */
  const ask = button(
    "Delete",
    () => {
      const sure = named(button("Really delete", remove, { kind: "small danger" }), "Really delete");
      ask.replaceWith(sure);
      sure.focus();
      sure.addEventListener("blur", () => sure.replaceWith(ask));
    },
    { kind: "small" },
  );
  return h(
    "li",
    { class: "work" },
    h("span", { class: "tile" }, icon("model")),
    h(
      "div",
      { class: "grow work-about" },
      h("strong", { class: "clip", text: name }),
      h("p", { class: "hint", text: about }),
      stopped ? h("p", { class: "hint", text: "Cagework stopped with it the last time." }) : null,
    ),
    h(
      "div",
      { class: "row" },
      where === "here" ? null : named(button(opens, open, { kind: "small" }), opens),
      where === "elsewhere" ? null : named(ask, "Delete"),
    ),
  );
}
