import { CageDeformer } from "@cagework/core/three";
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { TransformControls } from "three/addons/controls/TransformControls.js";

const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
renderer.setPixelRatio(devicePixelRatio);
document.body.append(renderer.domElement);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(35, 1, 0.1, 100);
camera.position.set(2.7, 2.7, 8);
const resize = () => {
  camera.aspect = innerWidth / innerHeight;
  camera.zoom = Math.min(1, camera.aspect);
  camera.updateProjectionMatrix();
  renderer.setSize(innerWidth, innerHeight);
};
addEventListener("resize", resize);
resize();
scene.add(new THREE.HemisphereLight("white", "gray", 4));

const material = new THREE.MeshStandardMaterial({ color: "#d98b4a", roughness: 0.5 });
const mesh = new THREE.Mesh(new THREE.TorusKnotGeometry(1, 0.35, 160, 24), material);
scene.add(mesh);

// Generate a cage around the geometry and bind the geometry to the cage, both in a worker.
const deformer = await CageDeformer.create(mesh.geometry, { grid: 32, cageOptions: { target: 60 } });

const posed = new THREE.BufferAttribute(deformer.pose, 3);
const cage = new THREE.BufferGeometry().setAttribute("position", posed);
cage.setIndex([...deformer.edges]);
const handles = new THREE.Points(
  cage,
  new THREE.PointsMaterial({ color: "#1f5fd0", size: 9, sizeAttenuation: false }),
);
const held = new THREE.Object3D();
mesh.add(new THREE.LineSegments(cage, new THREE.LineBasicMaterial({ color: "#1f5fd0" })), handles, held);

const orbit = new OrbitControls(camera, renderer.domElement);
const gizmo = new TransformControls(camera, renderer.domElement);
scene.add(gizmo.getHelper());
gizmo.addEventListener("dragging-changed", ({ value }) => {
  orbit.enabled = !value;
});
gizmo.addEventListener("objectChange", () => {
  posed.setXYZ(held.userData.vertex, ...held.position).needsUpdate = true;
  deformer.update();
});
const ray = new THREE.Raycaster();
ray.params.Points.threshold = 0.08;
renderer.domElement.addEventListener("pointerdown", ({ clientX: x, clientY: y }) => {
  ray.setFromCamera(new THREE.Vector2((2 * x) / innerWidth - 1, 1 - (2 * y) / innerHeight), camera);
  const [hit] = gizmo.axis ? [] : ray.intersectObject(handles);
  if (!hit) return;
  held.userData.vertex = hit.index;
  held.position.fromBufferAttribute(posed, hit.index);
  gizmo.attach(held);
});
renderer.setAnimationLoop(() => {
  orbit.update();
  renderer.render(scene, camera);
});
Object.assign(globalThis, { deformer, mesh }); // for the console
