/** The content of gallery.html: examples that are drawn live. Each is a link, which opens the page in the same state. */

import { render } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { decodeShare } from "../share";
import { loadTheme, shownTheme } from "../store";
import { type Message, messageOf, sentence } from "../strings";
import { Button, Say } from "../ui/controls";
import { GALLERY, loadGallery, T } from "../words";
import links from "./links.json";
import { type LiveExample, openLive } from "./live";

type Id = keyof typeof GALLERY.examples;
const LINKS: Readonly<Record<Id, string>> = links;

const dark = matchMedia("(prefers-color-scheme: dark)");
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** Share of an example that must be in view before it is opened. */
const MIN_VISIBLE_SHARE = 0.3;

/**
 * Settles when the examples requested so far are open. They are opened one at a time: opening several at once would not
 * be faster on few processor cores.
 */
let last: Promise<unknown> = Promise.resolve();
function inTurn(work: () => Promise<void>): void {
  last = last.then(work);
}

const theme = () => shownTheme(loadTheme(), dark);

function Example({ id }: { id: Id }) {
  const { title, text } = GALLERY.examples[id];
  const view = useRef<HTMLDivElement>(null);
  const live = useRef<LiveExample | undefined>(undefined);
  const [isLive, setIsLive] = useState(false);
  const [failure, setFailure] = useState<Message>();

  const failed = (message: Message) => {
    live.current = undefined;
    setIsLive(false);
    setFailure(message);
  };
  const play = () => live.current?.play(calm.matches);
  const open = async () => {
    try {
      const link = await decodeShare(LINKS[id]);
      if (!link || !view.current) return;
      live.current = await openLive(view.current, link, theme(), (reason) => failed(sentence(reason)));
      setIsLive(true);
      play();
    } catch (error) {
      failed(messageOf(error));
    }
  };
  const drag = ({ buttons, movementX, movementY }: PointerEvent) => {
    if (buttons === 1) live.current?.orbit(movementX, movementY);
  };

  useEffect(() => {
    if (!view.current) return;
    let isOpened = false;
    const watch = new IntersectionObserver(
      ([entry]) => {
        if (!entry?.isIntersecting) live.current?.stop();
        else if (!isOpened) inTurn(open);
        isOpened ||= entry?.isIntersecting === true;
      },
      { threshold: MIN_VISIBLE_SHARE },
    );
    watch.observe(view.current);
    dark.addEventListener("change", () => live.current?.applyTheme(theme()));
  }, []);

  return (
    <figure class="example" data-example={id} data-live={isLive}>
      <div class="example-view" ref={view} onPointerMove={drag}>
        <img src={`./samples/${sampleOf(id)}.webp`} alt="" hidden={isLive} />
      </div>
      <figcaption>
        <div class="grow">
          <h2>
            <a href={`./${LINKS[id]}`}>{title}</a>
          </h2>
          <Say kind="hint" text={failure ?? text} />
        </div>
        <Button
          label={GALLERY.play}
          name={GALLERY.playOf(title)}
          icon="play"
          onClick={play}
          disabled={!isLive}
        />
      </figcaption>
    </figure>
  );
}

const sampleOf = (id: Id) => new URLSearchParams(LINKS[id].slice(1)).get("sample");

/** Shows the gallery in place of the page. */
export async function showGallery(): Promise<void> {
  await loadGallery();
  const chosen = loadTheme();
  if (chosen !== "auto") document.documentElement.dataset.theme = chosen;
  document.title = GALLERY.name;
  const place = document.createElement("div");
  place.className = "examples-page";
  document.body.replaceChildren(place);
  render(
    <>
      <header>
        <h1>
          <a href="./">{T.product}</a> {GALLERY.title}
        </h1>
        <p class="hint">{GALLERY.sentence}</p>
      </header>
      <main class="examples">
        {(Object.keys(LINKS) as Id[]).map((id) => (
          <Example key={id} id={id} />
        ))}
      </main>
    </>,
    place,
  );
}
