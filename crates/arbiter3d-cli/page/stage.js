// Draws the bodies of a frame with three.js: instances of few meshes, so that thousands of bodies are few draw calls.
'use strict';

/** A box of half extents 1. Its attribute `edge` is the distance from the four sides of each face, 1 at the far one. */
function boxGeometry() {
  const geometry = new THREE.BoxGeometry(2, 2, 2);
  const uv = geometry.attributes.uv.array;
  const edge = Float32Array.from({ length: 2 * uv.length }, (_, i) => {
    const value = uv[2 * (i >> 2) + ((i >> 1) & 1)];
    return i & 1 ? 1 - value : value;
  });
  geometry.setAttribute('edge', new THREE.BufferAttribute(edge, 4));
  return geometry;
}

/**
 * Triangles with flat normals. Here `edge` is the distance from the three sides of the triangle (1 at the opposite
 * corner), and 1 all over for a side that lies inside a flat face: the shader draws lines where it nears 0.
 */
function flatGeometry({ vertices, triangles }) {
  const position = new Float32Array(9 * triangles.length);
  const normal = new Float32Array(9 * triangles.length);
  const edge = new Float32Array(12 * triangles.length).fill(1);
  const sides = new Map();
  const [a, b, c, n] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  triangles.forEach((triangle, index) => {
    triangle.forEach((vertex, corner) => position.set(vertices[vertex], 9 * index + 3 * corner));
    [a, b, c].forEach((point, corner) => point.fromArray(vertices[triangle[corner]]));
    n.crossVectors(b.sub(a), c.sub(a)).normalize();
    for (let corner = 0; corner < 3; corner++) n.toArray(normal, 9 * index + 3 * corner);
  });
  const hidden = new Set();
  triangles.forEach((triangle, index) => {
    for (let corner = 0; corner < 3; corner++) {
      const [from, to] = [triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]];
      const side = Math.min(from, to) * vertices.length + Math.max(from, to);
      const other = sides.get(side);
      if (other === undefined) {
        sides.set(side, 3 * index + corner);
      } else if (a.fromArray(normal, 9 * index).dot(b.fromArray(normal, 9 * Math.floor(other / 3))) > 0.9999) {
        hidden.add(3 * index + corner).add(other);
      }
    }
  });
  for (let index = 0; index < triangles.length; index++) {
    for (let corner = 0; corner < 3; corner++) {
      if (hidden.has(3 * index + corner)) continue;
      for (let vertex = 0; vertex < 3; vertex++) edge[12 * index + 4 * vertex + corner] = vertex === corner ? 1 : 0;
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
  geometry.setAttribute('edge', new THREE.BufferAttribute(edge, 4));
  return geometry;
}

/** The parts that draw a geometry: which unit mesh, how stretched, and how far along the shape's y axis. */
function partsOf(geometry, index) {
  switch (geometry.kind) {
    case 'cuboid':
      return [{ mesh: 'box', scale: geometry.half_extents, lift: 0 }];
    case 'sphere':
      return [{ mesh: 'ball', scale: Array(3).fill(geometry.radius), lift: 0 }];
    case 'capsule': {
      const { radius, half_length: half } = geometry;
      const ball = Array(3).fill(radius);
      return [
        { mesh: 'ball', scale: ball, lift: half },
        { mesh: 'ball', scale: ball, lift: -half },
        { mesh: 'tube', scale: [radius, half, radius], lift: 0 },
      ];
    }
    default:
      return [{ mesh: String(index), scale: [1, 1, 1], lift: 0 }];
  }
}

/** The mesh of a batch. Balls are round as far as their number allows: a million triangles are drawn at once. */
function meshOf(name, geometries, count) {
  if (name === 'box') return boxGeometry();
  if (name === 'ball') return new THREE.SphereGeometry(1, ...(count <= 200 ? [28, 18] : count <= 2000 ? [18, 12] : [12, 8]));
  if (name === 'tube') return new THREE.CylinderGeometry(1, 1, 2, 20, 1, true);
  return flatGeometry(geometries[Number(name)]);
}

/** Distance of a geometry's farthest point from its origin. */
function radiusOf(geometry) {
  if (geometry.kind === 'sphere') return geometry.radius;
  if (geometry.kind === 'capsule') return geometry.half_length + geometry.radius;
  if (geometry.kind === 'cuboid') return Math.hypot(...geometry.half_extents);
  return geometry.vertices.reduce((radius, vertex) => Math.max(radius, Math.hypot(...vertex)), 0);
}

/** Row-major 3×3 matrix of the quaternion at `q[at…]` (x, y, z, w), written to `m[to…]` in rows of `stride`. */
function writeRotation(q, at, m, to, stride) {
  const [x, y, z, w] = [q[at], q[at + 1], q[at + 2], q[at + 3]];
  m[to] = 1 - 2 * (y * y + z * z);
  m[to + 1] = 2 * (x * y - w * z);
  m[to + 2] = 2 * (x * z + w * y);
  m[to + stride] = 2 * (x * y + w * z);
  m[to + stride + 1] = 1 - 2 * (x * x + z * z);
  m[to + stride + 2] = 2 * (y * z - w * x);
  m[to + 2 * stride] = 2 * (x * z - w * y);
  m[to + 2 * stride + 1] = 2 * (y * z + w * x);
  m[to + 2 * stride + 2] = 1 - 2 * (x * x + y * y);
}

/**
 * A material with what tells bodies apart at little cost: lines along the edges of flat geometry, wedges on round
 * geometry so that rolling shows, and a grid of whole lengths on whatever stands still.
 */
function makeMaterial({ round = false, gridSize = 0, glass = false, shell = false, edgeStrength = 0.5 }) {
  const material = new THREE.MeshLambertMaterial(
    glass ? { transparent: true, opacity: 0.14, depthWrite: false, side: THREE.DoubleSide } : {},
  );
  if (shell) material.side = THREE.DoubleSide;
  const vertexParts = round
    ? ['varying vec3 vLocal;', 'vLocal = position;']
    : ['attribute vec4 edge; varying vec4 vEdge;', 'vEdge = edge;'];
  const fragmentParts = round
    ? [
        'varying vec3 vLocal;',
        `vec2 wedge = clamp(vLocal.xz / max(fwidth(vLocal.xz), 1e-6), -1.0, 1.0);
         diffuseColor.rgb *= 0.86 + 0.14 * wedge.x * wedge.y;`,
      ]
    : [
        'varying vec4 vEdge;',
        `vec4 edgeWidth = max(fwidth(vEdge), vec4(1e-6));
         vec4 edgeLine = (1.0 - smoothstep(0.4, 1.4, vEdge / edgeWidth)) * smoothstep(6.0, 24.0, 1.0 / edgeWidth);
         float onEdge = max(max(edgeLine.x, edgeLine.y), max(edgeLine.z, edgeLine.w));
         diffuseColor.rgb *= 1.0 - ${(glass ? -1.5 : edgeStrength).toFixed(2)} * onEdge;
         ${glass ? 'diffuseColor.a = mix(diffuseColor.a, 0.7, onEdge);' : ''}`,
      ];
  if (gridSize > 0) {
    vertexParts[0] += ' varying vec4 vGrid;';
    vertexParts[1] += ` vGrid.w = (instanceMatrix * vec4(normal, 0.0)).y / length((instanceMatrix * vec4(normal, 0.0)).xyz);
      vGrid.xyz = (instanceMatrix * vec4(position, 1.0)).xyz / ${gridSize.toFixed(6)};`;
    fragmentParts[0] += ` varying vec4 vGrid;
      float gridLine(vec2 cell) {
        vec2 width = fwidth(cell);
        vec2 line = 1.0 - min(abs(fract(cell - 0.5) - 0.5) / width, 1.0);
        return max(line.x, line.y) * (1.0 - smoothstep(0.05, 0.4, max(width.x, width.y)));
      }`;
    fragmentParts[1] += ` if (vGrid.w > 0.7) {
        diffuseColor.rgb += 0.012 * gridLine(vGrid.xz) + 0.025 * gridLine(0.1 * vGrid.xz);
      }`;
  }
  material.customProgramCacheKey = () => JSON.stringify([round, gridSize, glass, edgeStrength]);
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\n${vertexParts[0]}`)
      .replace('#include <begin_vertex>', `#include <begin_vertex>\n${vertexParts[1]}`);
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${fragmentParts[0]}`)
      .replace('#include <color_fragment>', `#include <color_fragment>\n${fragmentParts[1]}`);
  };
  return material;
}

/** Instances of one unit mesh on bodies of one class, in one draw call. */
class Batch {
  constructor(geometry, material, entries, bodyClass) {
    this.bodies = Uint32Array.from(entries, (entry) => entry.body);
    // Row-major 3×4: the shape's pose on its body times the stretch of the unit mesh.
    this.local = new Float32Array(12 * entries.length);
    entries.forEach((entry, i) => this.local.set(entry.local, 12 * i));
    this.mesh = new THREE.InstancedMesh(geometry, material, entries.length);
    this.mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    this.mesh.instanceColor = new THREE.InstancedBufferAttribute(new Float32Array(3 * entries.length), 3);
    this.mesh.frustumCulled = false;
    this.mesh.castShadow = this.mesh.receiveShadow = bodyClass !== 'glass';
    this.mesh.userData.batch = this;
    this.bodyClass = bodyClass;
  }

  /** Places every instance; `world` holds a row-major 3×4 matrix a body, all zero for a body that is absent. */
  place(world) {
    const target = this.mesh.instanceMatrix.array;
    for (let i = 0; i < this.bodies.length; i++) {
      const [w, l, t] = [12 * this.bodies[i], 12 * i, 16 * i];
      for (let row = 0; row < 3; row++) {
        const [x, y, z, p] = [world[w + 4 * row], world[w + 4 * row + 1], world[w + 4 * row + 2], world[w + 4 * row + 3]];
        for (let column = 0; column < 4; column++) {
          target[t + 4 * column + row] =
            x * this.local[l + column] + y * this.local[l + 4 + column] + z * this.local[l + 8 + column];
        }
        target[t + 12 + row] += p;
      }
      target[t + 15] = 1;
    }
    this.mesh.instanceMatrix.needsUpdate = true;
    this.mesh.boundingSphere = null;
  }

  paint(colours) {
    const target = this.mesh.instanceColor.array;
    for (let i = 0; i < this.bodies.length; i++) {
      for (let c = 0; c < 3; c++) target[3 * i + c] = colours[3 * this.bodies[i] + c];
    }
    this.mesh.instanceColor.needsUpdate = true;
  }
}

/** Dots at contacts and lines along their normals. */
class ContactOverlay {
  constructor(scene) {
    const dots = new THREE.PointsMaterial({ vertexColors: true, depthTest: false, transparent: true });
    dots.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace(
        '#include <fog_vertex>',
        '#include <fog_vertex>\ngl_PointSize = clamp(gl_PointSize, 2.5, 9.0);',
      );
      shader.fragmentShader = shader.fragmentShader.replace(
        '#include <color_fragment>',
        '#include <color_fragment>\nif (length(gl_PointCoord - 0.5) > 0.5) discard;',
      );
    };
    this.dots = new THREE.Points(new THREE.BufferGeometry(), dots);
    const lines = new THREE.LineBasicMaterial({ vertexColors: true, depthTest: false, transparent: true, opacity: 0.55 });
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), lines);
    for (const part of [this.dots, this.lines]) {
      part.frustumCulled = false;
      part.renderOrder = 10;
      scene.add(part);
    }
  }

  /** Shows the contacts listed; `length` is that of the normals. Weak contacts are pale blue, strong ones red. */
  show(detail, chosen, length) {
    const points = new Float32Array(3 * chosen.length);
    const ends = new Float32Array(6 * chosen.length);
    const colours = new Float32Array(3 * chosen.length);
    const lineColours = new Float32Array(6 * chosen.length);
    let strongest = 0;
    for (const contact of chosen) strongest = Math.max(strongest, detail.impulses[contact]);
    chosen.forEach((contact, i) => {
      const strength = strongest > 0 ? Math.sqrt(Math.max(detail.impulses[contact], 0) / strongest) : 0;
      const colour = CONTACT_COLOURS[Math.round(16 * strength)];
      for (let axis = 0; axis < 3; axis++) {
        const start = detail.points[3 * contact + axis];
        points[3 * i + axis] = ends[6 * i + axis] = start;
        ends[6 * i + 3 + axis] = start + length * detail.normals[3 * contact + axis];
        colours[3 * i + axis] = lineColours[6 * i + axis] = lineColours[6 * i + 3 + axis] = colour[axis];
      }
    });
    this.dots.material.size = 0.4 * length;
    this.fill(this.dots, points, colours);
    this.fill(this.lines, ends, lineColours);
  }

  fill(part, positions, colours) {
    part.geometry.dispose();
    part.geometry = new THREE.BufferGeometry();
    part.geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    part.geometry.setAttribute('color', new THREE.BufferAttribute(colours, 3));
    part.visible = positions.length > 0;
  }
}

/** Linear colour components from HSL in [0, 1]. */
function hsl(hue, saturation, lightness) {
  const colour = new THREE.Color().setHSL(hue, saturation, lightness);
  return [colour.r, colour.g, colour.b];
}

/** Neighbouring numbers get hues far apart: steps of the golden angle. */
const ISLAND_COLOURS = Array.from({ length: 64 }, (_, i) =>
  hsl((0.58 + i * 0.61803398875) % 1, 0.42 + 0.12 * (i % 3), 0.47 + 0.06 * (i % 2)),
);
const NO_ISLAND_COLOUR = hsl(0.58, 0.4, 0.52);
const FIXED_COLOUR = hsl(0.6, 0.1, 0.15);
const KINEMATIC_COLOUR = hsl(0.59, 0.25, 0.36);
const GLASS_COLOUR = hsl(0.57, 0.3, 0.7);
const SELECTED_COLOUR = [1.0, 0.72, 0.12];
const SELECTED_FIXED_COLOUR = [0.16, 0.12, 0.04];
const CONTACT_COLOURS = gradient(['#bfe3f2', '#7cc4e8', '#f2c14e', '#f2762e', '#e5383b'], 16);
const SPEED_STOPS = ['#3b4cc0', '#3fa7d6', '#59cd90', '#f2c14e', '#ee6352'];
const SPEED_COLOURS = gradient(SPEED_STOPS, 64);

/** `count + 1` colours from the first stop to the last. */
function gradient(stops, count) {
  return Array.from({ length: count + 1 }, (_, i) => {
    const at = (i / count) * (stops.length - 1);
    const from = Math.min(Math.floor(at), stops.length - 2);
    const colour = new THREE.Color(stops[from]).lerp(new THREE.Color(stops[from + 1]), at - from);
    return [colour.r, colour.g, colour.b];
  });
}

/** A fixed fraction in [0, 1) for each body: neighbours of one island differ a little in brightness. */
function scatter(index) {
  let bits = Math.imul(index + 1, 0x9e3779b1);
  bits = Math.imul(bits ^ (bits >>> 15), 0x2c1b3c6d);
  return ((bits ^ (bits >>> 13)) & 0xffff) / 0x10000;
}

class Stage {
  constructor(canvas, scene) {
    this.data = scene;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.setSharpness(1);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.world = new THREE.Scene();
    this.world.background = new THREE.Color('#15181c');
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.1, 1000);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.15;
    this.controls.addEventListener('change', () => (this.dirty = true));
    this.bodyCount = scene.bodies.length;
    this.matrices = new Float32Array(12 * this.bodyCount);
    this.quaternions = new Float64Array(4 * this.bodyCount);
    this.colours = new Float32Array(3 * this.bodyCount);
    this.bodyRadius = new Float32Array(this.bodyCount);
    for (const shape of scene.shapes) {
      const reach = Math.hypot(...shape.position) + radiusOf(scene.geometries[shape.geometry]);
      this.bodyRadius[shape.body] = Math.max(this.bodyRadius[shape.body], reach);
    }
    this.overlay = new ContactOverlay(this.world);
    this.dirty = true;
  }

  /** Builds the batches, once the first frame's poses are in `matrices`. */
  build() {
    this.focus = this.bounds();
    this.glassBodies = this.findContainers();
    const radii = this.movingBodies().map((body) => this.bodyRadius[body]).sort((a, b) => a - b);
    this.typicalRadius = radii[radii.length >> 1] || 1;
    const entries = new Map();
    for (const shape of this.data.shapes) {
      const bodyClass = this.classOf(shape.body);
      for (const part of partsOf(this.data.geometries[shape.geometry], shape.geometry)) {
        const key = `${part.mesh} ${bodyClass}`;
        if (!entries.has(key)) entries.set(key, []);
        entries.get(key).push({ body: shape.body, local: this.localMatrix(shape, part) });
      }
    }
    this.batches = [...entries].map(([key, list]) => {
      const [name, bodyClass] = key.split(' ');
      const kind = this.data.geometries[Number(name)]?.kind;
      const gridSize = bodyClass === 'fixed' ? 10 ** Math.round(Math.log10(2.5 * this.typicalRadius)) : 0;
      const look = {
        round: name === 'ball' || name === 'tube',
        gridSize,
        glass: bodyClass === 'glass',
        shell: kind === 'mesh',
        edgeStrength: bodyClass === 'moving' ? 0.5 : 0.22,
      };
      const batch = new Batch(meshOf(name, this.data.geometries, list.length), makeMaterial(look), list, bodyClass);
      batch.solidMaterial = look.glass ? makeMaterial({ ...look, glass: false }) : batch.mesh.material;
      batch.glassMaterial = batch.mesh.material;
      this.world.add(batch.mesh);
      return batch;
    });
    this.light();
    this.frameView();
  }

  classOf(body) {
    if (this.glassBodies.has(body)) return 'glass';
    return this.data.bodies[body].kind === 'dynamic' ? 'moving' : 'fixed';
  }

  movingBodies() {
    return [...this.data.bodies.keys()].filter((body) => this.data.bodies[body].kind === 'dynamic');
  }

  localMatrix(shape, part) {
    const matrix = new Float32Array(12);
    writeRotation(shape.rotation, 0, matrix, 0, 4);
    for (let row = 0; row < 3; row++) {
      matrix[4 * row + 3] = shape.position[row] + part.lift * matrix[4 * row + 1];
      for (let column = 0; column < 3; column++) matrix[4 * row + column] *= part.scale[column];
    }
    return matrix;
  }

  /** Drums and boxes around the bodies would hide them: fixed bodies of several shapes that surround the middle. */
  findContainers() {
    const shapes = new Map();
    for (const shape of this.data.shapes) {
      if (!shapes.has(shape.body)) shapes.set(shape.body, []);
      shapes.get(shape.body).push(shape);
    }
    const containers = new Set();
    for (const [body, list] of shapes) {
      if (this.data.bodies[body].kind === 'dynamic' || list.length < 5) continue;
      const sides = new Set();
      for (const shape of list) {
        const m = 12 * body;
        for (let row = 0; row < 3; row++) {
          let centre = this.matrices[m + 4 * row + 3];
          for (let c = 0; c < 3; c++) centre += this.matrices[m + 4 * row + c] * shape.position[c];
          const offset = centre - this.focus.centre.getComponent(row);
          if (Math.abs(offset) > 0.5 * this.focus.radius) sides.add(2 * row + (offset > 0 ? 1 : 0));
        }
      }
      if (sides.size >= 4) containers.add(body);
    }
    return containers;
  }

  /** A ball around the moving bodies that are there; a few far ones do not count. */
  bounds() {
    const moving = this.movingBodies().filter((body) => this.isPresent(body));
    const shown = moving.length > 0 ? moving : [...this.data.bodies.keys()].filter((body) => this.isPresent(body));
    const range = [0, 1, 2].map((axis) => {
      const sorted = Float32Array.from(shown, (body) => this.matrices[12 * body + 4 * axis + 3]).sort();
      const skip = Math.floor(sorted.length / 100);
      return [sorted[skip] ?? 0, sorted[sorted.length - 1 - skip] ?? 0];
    });
    const centre = new THREE.Vector3(...range.map(([low, high]) => (low + high) / 2));
    const spread = Math.hypot(...range.map(([low, high]) => (high - low) / 2));
    const largest = shown.reduce((radius, body) => Math.max(radius, this.bodyRadius[body]), 0);
    return { centre, radius: spread + largest || 1 };
  }

  isPresent(body) {
    const m = 12 * body;
    return this.matrices[m] !== 0 || this.matrices[m + 1] !== 0 || this.matrices[m + 2] !== 0;
  }

  light() {
    const { centre, radius } = this.focus;
    this.world.add(new THREE.HemisphereLight('#dfe9f5', '#3a3836', 1.3));
    const sun = new THREE.DirectionalLight('#fff4e2', 2.3);
    const reach = 1.8 * radius;
    sun.position.copy(centre).add(new THREE.Vector3(0.55, 1.25, 0.4).multiplyScalar(2 * reach));
    sun.target.position.copy(centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.normalBias = 0.002 * reach;
    sun.shadow.bias = -0.0004;
    const box = sun.shadow.camera;
    box.left = box.bottom = -reach;
    box.right = box.top = reach;
    box.near = 0.1 * reach;
    box.far = 6 * reach;
    this.world.add(sun, sun.target);
    this.sun = sun;
    this.world.fog = new THREE.Fog(this.world.background, 10 * radius, 40 * radius);
  }

  /** Looks at the moving bodies, or at a ball, from a little above and as near as all of it fits. */
  frameView(ball = null) {
    const focus = ball ?? this.bounds();
    const toCamera = new THREE.Vector3(0.62, 0.5, 0.9).normalize();
    this.controls.target.copy(focus.centre);
    this.camera.position.copy(focus.centre).add(toCamera);
    this.camera.lookAt(focus.centre);
    const distance = ball ? focus.radius / this.slopes()[1] : this.fittingDistance(focus.centre, toCamera);
    this.camera.position.copy(focus.centre).addScaledVector(toCamera, distance);
    this.camera.near = Math.min(distance, this.focus.radius) * 0.01;
    this.camera.far = Math.max(distance, this.focus.radius) * 60;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Half the width and half the height of what is seen at distance 1. */
  slopes() {
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    return [slope * this.camera.aspect, slope];
  }

  /** From where all moving bodies but one in a hundred are inside the window's middle. */
  fittingDistance(centre, toCamera) {
    const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1);
    const [wide, high] = this.slopes();
    const offset = new THREE.Vector3();
    const needed = this.movingBodies().filter((body) => this.isPresent(body)).map((body) => {
      const radius = this.bodyRadius[body];
      offset.set(...[3, 7, 11].map((at) => this.matrices[12 * body + at])).sub(centre);
      const aside = (Math.abs(offset.dot(right)) + radius) / wide;
      const above = (Math.abs(offset.dot(up)) + radius) / high;
      return offset.dot(toCamera) + 1.35 * Math.max(aside, above);
    });
    needed.sort((a, b) => a - b);
    return needed[Math.floor(0.99 * (needed.length - 1))] ?? 3 * this.focus.radius;
  }

  resize() {
    const [width, height] = [window.innerWidth, window.innerHeight];
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Sets the bodies' matrices to frame `a`, or to a blend of two frames. */
  pose(a, b, blend) {
    const { position_step: step } = this.data;
    const q = this.quaternions;
    for (let body = 0; body < this.bodyCount; body++) {
      const [p, m] = [COMPONENTS * body, 12 * body];
      if (a.states[body] === ABSENT) {
        this.matrices.fill(0, m, m + 12);
        continue;
      }
      const weight = b.states[body] === ABSENT ? 0 : blend;
      for (let axis = 0; axis < 3; axis++) {
        this.matrices[m + 4 * axis + 3] = step * (a.poses[p + axis] + weight * (b.poses[p + axis] - a.poses[p + axis]));
      }
      // Two frames of one chunk keep the sign of a quaternion; across chunks it may have turned.
      let [dot, length] = [0, 0];
      for (let c = 3; c < 7; c++) dot += a.poses[p + c] * b.poses[p + c];
      const sign = dot < 0 ? -1 : 1;
      for (let c = 0; c < 4; c++) {
        const value = a.poses[p + 3 + c] + weight * (sign * b.poses[p + 3 + c] - a.poses[p + 3 + c]);
        q[4 * body + c] = value;
        length += value * value;
      }
      const inverse = length > 0 ? 1 / Math.sqrt(length) : 0;
      for (let c = 0; c < 4; c++) q[4 * body + c] *= inverse;
      writeRotation(q, 4 * body, this.matrices, m, 4);
    }
  }

  place() {
    for (const batch of this.batches) batch.place(this.matrices);
    this.renderer.shadowMap.needsUpdate = true;
    this.dirty = true;
  }

  /** Colours of all bodies; `speeds` is null to colour by island. */
  paint(frame, speeds, selected) {
    for (let body = 0; body < this.bodyCount; body++) {
      const dynamic = this.data.bodies[body].kind === 'dynamic';
      const highlight = dynamic ? SELECTED_COLOUR : SELECTED_FIXED_COLOUR;
      const colour = body === selected ? highlight : this.colourOf(body, frame, speeds);
      const varies = dynamic && body !== selected;
      const asleep = varies && frame.states[body] !== AWAKE;
      const shade = (varies ? 0.86 + 0.28 * scatter(body) : 1) * (asleep ? 0.4 : 1);
      const grey = (colour[0] + colour[1] + colour[2]) / 3;
      const fade = asleep ? 0.45 : 0;
      for (let c = 0; c < 3; c++) this.colours[3 * body + c] = shade * (colour[c] + fade * (grey - colour[c]));
    }
    for (const batch of this.batches) batch.paint(this.colours);
    this.dirty = true;
  }

  colourOf(body, frame, speeds) {
    if (this.glassBodies.has(body)) return GLASS_COLOUR;
    const { kind } = this.data.bodies[body];
    if (kind === 'static') return FIXED_COLOUR;
    if (kind === 'kinematic') return KINEMATIC_COLOUR;
    if (speeds) return SPEED_COLOURS[Math.min(64, Math.round((64 * speeds[body]) / this.data.top_speed))] || SPEED_COLOURS[0];
    const island = frame.islands[body];
    return island < 0 ? NO_ISLAND_COLOUR : ISLAND_COLOURS[Math.floor(scatter(island) * ISLAND_COLOURS.length)];
  }

  setGlass(seeThrough) {
    for (const batch of this.batches.filter((one) => one.bodyClass === 'glass')) {
      batch.mesh.material = seeThrough ? batch.glassMaterial : batch.solidMaterial;
    }
    this.dirty = true;
  }

  /** Pixels drawn for each of the screen's, along an edge: less is faster. */
  setSharpness(sharpness) {
    if (this.sharpness === sharpness) return;
    this.sharpness = sharpness;
    this.renderer.setPixelRatio(sharpness * Math.min(window.devicePixelRatio, 2));
    this.dirty = true;
  }

  setShadows(on) {
    this.sun.castShadow = on;
    this.renderer.shadowMap.needsUpdate = true;
    this.dirty = true;
  }

  /** The body under a point of the window, or −1. What moves wins over what stands, and that over see-through walls. */
  pick(x, y) {
    const pointer = new THREE.Vector2((2 * x) / window.innerWidth - 1, 1 - (2 * y) / window.innerHeight);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(pointer, this.camera);
    const hits = ray.intersectObjects(this.batches.map((batch) => batch.mesh), false);
    const inFront = hits.find((hit) => hit.object.material.depthWrite) || hits[0];
    return inFront ? inFront.object.userData.batch.bodies[inFront.instanceId] : -1;
  }

  draw() {
    this.dirty = false;
    this.renderer.render(this.world, this.camera);
  }
}
