/** The page's icons (Lucide, 24 x 24, strokes only) and the product's mark. */

import * as lucide from "lucide";
import { h } from "preact";

const ICONS = {
  model: lucide.Box,
  cage: lucide.Hexagon,
  shape: lucide.Shapes,
  bind: lucide.Link2,
  pose: lucide.PersonStanding,
  export: lucide.Upload,
  open: lucide.FolderOpen,
  upload: lucide.Download,
  download: lucide.Download,
  undo: lucide.Undo2,
  redo: lucide.Redo2,
  eye: lucide.Eye,
  share: lucide.Share2,
  sun: lucide.Sun,
  moon: lucide.Moon,
  auto: lucide.SunMoon,
  pull: lucide.Hand,
  select: lucide.MousePointer2,
  move: lucide.Move,
  rotate: lucide.RotateCw,
  scale: lucide.Scaling,
  vertex: lucide.CircleDot,
  edge: lucide.Slash,
  face: lucide.Triangle,
  symmetry: lucide.MirrorRectangular,
  proportional: lucide.Target,
  box: lucide.SquareDashed,
  frame: lucide.Focus,
  perspective: lucide.Grid2x2,
  check: lucide.Check,
  close: lucide.X,
  warning: lucide.TriangleAlert,
  info: lucide.Info,
  lock: lucide.Lock,
  pause: lucide.Pause,
  play: lucide.Play,
  stop: lucide.Square,
  plus: lucide.Plus,
  trash: lucide.Trash,
  reset: lucide.RotateCcw,
  spark: lucide.Sparkles,
  clamp: lucide.Pyramid,
  file: lucide.File,
  image: lucide.Image,
  layers: lucide.Layers,
  table: lucide.Table,
  save: lucide.Save,
  help: lucide.CircleQuestionMark,
  tour: lucide.Signpost,
  split: lucide.SquareSplitHorizontal,
  merge: lucide.Merge,
  extrude: lucide.ArrowUpFromLine,
  grow: lucide.Expand,
  patch: lucide.Bandage,
  bone: lucide.Bone,
  hidden: lucide.EyeOff,
  rigid: lucide.Gem,
  stays: lucide.Anchor,
  brush: lucide.Brush,
  copy: lucide.Copy,
  loop: lucide.Repeat,
  options: lucide.SlidersHorizontal,
} satisfies Record<string, lucide.IconNode>;

export type IconName = keyof typeof ICONS;

/** An icon. It is hidden from screen readers, which read the name of the button around it. */
export function Icon({ name }: { name: IconName }) {
  return (
    <svg viewBox="0 0 24 24" class="icon" aria-hidden="true">
      {ICONS[name].map(([tag, attributes]) => h(tag, attributes))}
    </svg>
  );
}

export function Mark() {
  const spots = [
    [16, 3.2],
    [27, 9.5],
    [27, 22.5],
    [16, 28.8],
    [5, 22.5],
    [5, 9.5],
    [16, 16],
  ];
  return (
    <svg viewBox="0 0 32 32" class="mark" aria-hidden="true">
      <g fill="none" stroke="currentColor" stroke-width="2.2" stroke-linejoin="round">
        <path d="M16 3 27 9.5v13L16 29 5 22.5v-13Z" />
        <path d="M5 9.5 16 16l11-6.5M16 16v13" opacity="0.6" />
      </g>
      {spots.map(([cx, cy]) => (
        <circle key={`${cx} ${cy}`} cx={cx} cy={cy} r="2.7" fill="currentColor" />
      ))}
    </svg>
  );
}
