import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig } from "@playwright/test";
import { WEBGL_LAUNCH } from "../e2e/browser";

const PORT = 8897;
/** The folder that JupyterLab shows. `widget.spec.ts` reads the pose that the notebook writes there. */
const FOLDER = join(import.meta.dirname, "../../target/notebook-lab");

const CELLS = [
  `import json, pathlib
import cagework as cw, ipywidgets, numpy as np, trimesh
mesh = trimesh.creation.capsule(height=1.4, radius=0.3, count=[16, 16])
cage = cw.generate_cage(mesh.vertices, mesh.faces, target=24)
widget = cw.show(mesh, cage, height=320)
def write(change):
    pathlib.Path("pose.json").write_text(json.dumps({"rest": cage.vertices.tolist(), "pose": widget.pose.tolist(), "max": widget.deformed.max(0).tolist()}))
widget.observe(write, "pose")
widget`,
  `slider = ipywidgets.FloatSlider(1, min=1, max=2, step=0.1, description="length")
def lengthen(change):
    widget.pose = cage.vertices * [1, 1, slider.value]
slider.observe(lengthen, "value")
slider`,
];

mkdirSync(FOLDER, { recursive: true });
const cell = (source: string, k: number) => ({
  id: `c${k}`,
  cell_type: "code",
  execution_count: null,
  metadata: {},
  outputs: [],
  source,
});
const kernelspec = { name: "python3", display_name: "Python 3", language: "python" };
const notebook = { cells: CELLS.map(cell), metadata: { kernelspec }, nbformat: 4, nbformat_minor: 5 };
writeFileSync(join(FOLDER, "widget.ipynb"), JSON.stringify(notebook));

export default defineConfig({
  testDir: import.meta.dirname,
  outputDir: "../../target/e2e-notebook",
  workers: 1,
  timeout: 180_000,
  expect: { timeout: 60_000 },
  reporter: [["list"]],
  metadata: { folder: FOLDER },
  use: {
    baseURL: `http://127.0.0.1:${PORT}/`,
    viewport: { width: 1440, height: 900 },
    screenshot: "only-on-failure",
    launchOptions: WEBGL_LAUNCH,
  },
  webServer: {
    command: `${process.env.NOTEBOOK_PYTHON} -m jupyterlab --no-browser --allow-root --port ${PORT} --ServerApp.token= --ServerApp.root_dir=. --LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate`,
    cwd: FOLDER,
    url: `http://127.0.0.1:${PORT}/api`,
    reuseExistingServer: false,
    stdout: "ignore",
    stderr: "ignore",
  },
});
