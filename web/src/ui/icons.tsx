/** The page's icons (Lucide, 24 x 24, strokes only) and the product's mark. */

import {
  Anchor,
  ArrowUpFromLine,
  Bandage,
  Bone,
  Box,
  Brush,
  Check,
  CircleDot,
  CircleQuestionMark,
  Copy,
  Download,
  Expand,
  Eye,
  EyeOff,
  File,
  Focus,
  FolderOpen,
  Gem,
  Grid2x2,
  GripVertical,
  Hand,
  Hexagon,
  type IconNode,
  Image,
  Info,
  Layers,
  Link2,
  Lock,
  Merge,
  MirrorRectangular,
  Moon,
  MousePointer2,
  Move,
  Pause,
  PersonStanding,
  Play,
  Plus,
  Pyramid,
  Redo2,
  RotateCcw,
  RotateCw,
  Save,
  Scaling,
  Shapes,
  Share2,
  Signpost,
  Slash,
  Sparkles,
  Square,
  SquareDashed,
  SquareSplitHorizontal,
  Sun,
  SunMoon,
  Table,
  Target,
  Trash,
  Triangle,
  TriangleAlert,
  Undo2,
  Upload,
  X,
} from "lucide";
import { h } from "preact";

const ICONS = {
  model: Box,
  cage: Hexagon,
  shape: Shapes,
  bind: Link2,
  pose: PersonStanding,
  export: Upload,
  open: FolderOpen,
  upload: Download,
  download: Download,
  undo: Undo2,
  redo: Redo2,
  eye: Eye,
  share: Share2,
  sun: Sun,
  moon: Moon,
  auto: SunMoon,
  pull: Hand,
  select: MousePointer2,
  move: Move,
  rotate: RotateCw,
  scale: Scaling,
  vertex: CircleDot,
  edge: Slash,
  face: Triangle,
  symmetry: MirrorRectangular,
  proportional: Target,
  box: SquareDashed,
  frame: Focus,
  perspective: Grid2x2,
  check: Check,
  close: X,
  warning: TriangleAlert,
  info: Info,
  lock: Lock,
  pause: Pause,
  play: Play,
  stop: Square,
  plus: Plus,
  trash: Trash,
  reset: RotateCcw,
  spark: Sparkles,
  clamp: Pyramid,
  file: File,
  image: Image,
  layers: Layers,
  table: Table,
  save: Save,
  help: CircleQuestionMark,
  tour: Signpost,
  split: SquareSplitHorizontal,
  merge: Merge,
  extrude: ArrowUpFromLine,
  grow: Expand,
  patch: Bandage,
  bone: Bone,
  hidden: EyeOff,
  rigid: Gem,
  stays: Anchor,
  brush: Brush,
  copy: Copy,
  grip: GripVertical,
} satisfies Record<string, IconNode>;

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
