// One run in a three.js scene: surfaces that follow a take, their colours, and what a ray meets.

import * as THREE from './three.min.js'
import { unfold } from './take.js'
import { Splats } from './splats.js'

const PAPER = 0xece9e2, GROUND = 0xcfcac0, ACCENT = 0x1f6f8b
const SRGB = 2.2 // vertex colours are linear light
const BARE = [.72, .72, .72]
const UNSEEN = 1 // layer of what a ray meets and no picture shows
const TILE = 256 // pixels along a square of the floor's grid

// Squares on the floor that fit a scene of this size [m]: 1, 10 … mm or m.
export const squareOf = size => 10 ** Math.round(Math.log10(size / 8))

// A picture of one square, to be repeated: two of its edges.
function squarePicture() {
  const canvas = Object.assign(document.createElement('canvas'), {width: TILE, height: TILE})
  const pen = canvas.getContext('2d')
  pen.fillStyle = '#fff'
  pen.fillRect(0, 0, TILE, TILE)
  pen.fillStyle = '#bdbdbd'
  pen.fillRect(0, 0, TILE, 3)
  pen.fillRect(0, 0, 3, TILE)
  const picture = new THREE.CanvasTexture(canvas)
  picture.wrapS = picture.wrapT = THREE.RepeatWrapping
  picture.anisotropy = 8
  return picture
}

export const linear = share => share ** SRGB
export const rgbOf = hex => [1, 3, 5].map(k => linear(parseInt(hex.slice(k, k + 2), 16) / 255))

// The name of the graphics card; software renderers get fewer pixels and no shadows.
export function graphics() {
  const gl = document.createElement('canvas').getContext('webgl2')
  if (!gl) return ''
  const named = gl.getExtension('WEBGL_debug_renderer_info')
  return String(gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER))
}

export class Stage {
  constructor(take, shadows) {
    this.take = take
    this.scene = new THREE.Scene()
    this.scene.background = new THREE.Color(PAPER)
    this.hidden = new Set()
    this.by = 'itself'
    this.frame = -1
    this.light(shadows)
    this.finishes = take.header.finishes.map(finish => this.materialOf(finish))
    this.bare = new THREE.MeshStandardMaterial({vertexColors: true, roughness: .85, side: THREE.DoubleSide})
    this.meshes = take.header.surfaces.map(surface => this.meshOf(surface))
    this.overlay = []
    this.fastest = null
    this.liveTop = null // of the stresses of a simulation that runs [Pa]
    this.tops = {} // where scales of colours end, if not at this run's own largest value
    this.changed = () => {}
    this.splats = null // where Gaussians are shown in place of surfaces
  }

  // Show the Gaussians of a scene that was made of them, or its surfaces again, which a ray meets all the same.
  clad(on) {
    if (on === Boolean(this.splats) || !this.take.header.splats) return
    if (on) this.scene.add((this.splats = new Splats(this.take)).mesh)
    else { this.scene.remove(this.splats.mesh); this.splats.free(); this.splats = null }
    for (const mesh of this.meshes) { if (on) mesh.layers.set(UNSEEN); else mesh.layers.set(0) }
    const t = this.frame
    this.frame = -1
    if (t >= 0) this.show(t)
  }

  light(shadows) {
    const {low, high} = this.take.header, size = this.size = Math.hypot(...high.map((h, k) => h - low[k])) || 1
    const mid = this.middle = high.map((h, k) => (h + low[k]) / 2)
    this.fade(size)
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9a8f80, 2.2))
    const sun = new THREE.DirectionalLight(0xffffff, 2.4)
    sun.position.set(mid[0] + .5 * size, mid[1] - .8 * size, mid[2] + 2 * size)
    sun.target.position.set(...mid)
    this.scene.add(sun, sun.target)
    if (shadows) {
      sun.castShadow = true
      sun.shadow.mapSize.set(2048, 2048)
      sun.shadow.radius = 5
      sun.shadow.normalBias = .004 * size
      Object.assign(sun.shadow.camera, {left: -size, right: size, top: size, bottom: -size, near: .01 * size, far: 6 * size})
      sun.shadow.camera.updateProjectionMatrix()
    }
    this.ground = new THREE.Mesh(new THREE.PlaneGeometry(60 * size, 60 * size),
      new THREE.MeshStandardMaterial({color: GROUND, roughness: 1, map: squarePicture()}))
    this.ground.position.set(mid[0], mid[1], -.0005 * size)
    this.ground.receiveShadow = true
    this.scene.add(this.ground)
  }

  // Rule the floor in squares [m], one corner at the origin: what hangs above it is seen to.
  rule(square) {
    const {map} = this.ground.material, count = 60 * this.size / square
    map.repeat.set(count, count)
    map.offset.set(...this.middle.slice(0, 2).map(m => (m / square - count / 2) % 1))
  }

  // Let the floor end in haze, at distances of a scene of this size [m].
  fade(size) { this.scene.fog = new THREE.Fog(PAPER, 5 * size, 25 * size) }

  materialOf(finish) {
    const seen = 1 - .75 * finish.transmission, opacity = finish.alpha === 'OPAQUE' ? seen : seen * finish.colour[3]
    const material = new THREE.MeshStandardMaterial({
      roughness: finish.roughness, metalness: Math.min(finish.metallic, .6), side: THREE.DoubleSide,
      transparent: opacity < 1 || finish.alpha === 'BLEND', opacity, alphaTest: finish.alpha === 'MASK' ? finish.cutoff : 0,
    })
    material.color.setRGB(...finish.colour.slice(0, 3))
    if (finish.texture) {
      new THREE.TextureLoader().load(finish.texture, texture => {
        texture.colorSpace = THREE.SRGBColorSpace
        texture.flipY = false
        texture.wrapS = texture.wrapT = THREE.RepeatWrapping
        material.map = texture
        material.needsUpdate = true
        this.changed()
      })
    }
    return material
  }

  meshOf(surface) {
    const take = this.take, shape = new THREE.BufferGeometry(), n = surface.count
    const put = (name, array, size) => shape.setAttribute(name, new THREE.BufferAttribute(array, size))
    const rest = take.array(surface.place), folded = take.array(surface.normal), normal = new Float32Array(3 * n)
    for (let v = 0; v < n; v++) unfold(folded[2 * v], folded[2 * v + 1], normal, 3 * v)
    put('position', rest.slice(), 3)
    put('normal', normal, 3)
    put('color', new Float32Array(3 * n).fill(1), 3)
    if (surface.uv) put('uv', take.array(surface.uv), 2)
    const triangles = take.array(surface.triangles), ofTriangle = take.array(surface.part)
    shape.setIndex(new THREE.BufferAttribute(triangles, 1))
    let finish = this.finishes[surface.finish]
    const own = surface.colour && Float32Array.from(take.array(surface.colour), c => linear(c / 255))
    if (own) { finish = finish.clone(); finish.vertexColors = true }
    const mesh = new THREE.Mesh(shape, finish)
    Object.assign(mesh, {surface, rest, normals: normal.slice(), own, finish, ofTriangle, ofVertex: new Int16Array(n).fill(-1)})
    for (let k = 0; k < triangles.length; k++) mesh.ofVertex[triangles[k]] = ofTriangle[(k / 3) | 0]
    if (own) shape.attributes.color.array.set(own)
    mesh.castShadow = mesh.receiveShadow = true
    mesh.frustumCulled = mesh.matrixAutoUpdate = false
    this.scene.add(mesh)
    return mesh
  }

  // Give back what the graphics card holds of it.
  free() {
    this.splats?.free()
    this.scene.traverse(thing => thing.geometry?.dispose())
    for (const material of [...this.finishes, this.bare, this.ground.material]) { material.map?.dispose(); material.dispose() }
  }

  // ---------------------------------------------------------------- one instant

  show(t) {
    if (t === this.frame) return
    this.frame = t
    this.take.header.objects.forEach((_, k) => this.place(k, this.take.instant(k, t)))
    if (Object.keys(this.take.header.video.since).length) this.unveil()
    if (this.by === 'speed') this.paintSpeed(t)
  }

  // Every object stands in its pose; vertices of one that deforms are at rest + residual in the pose's frame.
  place(k, {pose, residual, normal, stress}) {
    this.splats?.place(k, {pose, residual}, this.take.step, !this.seen(k))
    for (const mesh of this.meshes) {
      if (mesh.surface.object !== k) continue
      mesh.matrix.set(pose[0], pose[1], pose[2], pose[9], pose[3], pose[4], pose[5], pose[10],
        pose[6], pose[7], pose[8], pose[11], 0, 0, 0, 1)
      mesh.matrixWorldNeedsUpdate = true
      if (residual) this.deform(mesh, residual, normal)
      else if (mesh.deformed) this.undo(mesh)
      if (residual && stress && this.by === 'stress') this.paintStress(mesh, stress)
    }
  }

  // As everything stands before it has moved.
  begin() {
    this.frame = -1
    for (const mesh of this.meshes) {
      mesh.matrix.identity()
      mesh.matrixWorldNeedsUpdate = true
      if (mesh.deformed) this.undo(mesh)
    }
  }

  // A rigid object looks as it does at rest.
  undo(mesh) {
    const {position, normal} = mesh.geometry.attributes
    position.array.set(mesh.rest)
    normal.array.set(mesh.normals)
    position.needsUpdate = normal.needsUpdate = true
    mesh.geometry.boundingSphere = mesh.geometry.boundingBox = null
    mesh.deformed = false
  }

  deform(mesh, residual, normal) {
    mesh.deformed = true
    const {position, normal: normals} = mesh.geometry.attributes, {start, count} = mesh.surface, step = this.take.step
    for (let v = 0, to = 0; v < count; v++, to += 3) {
      const from = 3 * (start + v), pair = 2 * (start + v)
      position.array[to] = mesh.rest[to] + step * residual[from]
      position.array[to + 1] = mesh.rest[to + 1] + step * residual[from + 1]
      position.array[to + 2] = mesh.rest[to + 2] + step * residual[from + 2]
      unfold(normal[pair], normal[pair + 1], normals.array, to)
    }
    position.needsUpdate = normals.needsUpdate = true
    mesh.geometry.boundingSphere = mesh.geometry.boundingBox = null
  }

  // World position of vertex v of object k in frame t [m].
  where(mesh, v, t, out) {
    const {pose, residual} = this.take.instant(mesh.surface.object, t), at = 3 * (mesh.surface.start + v), step = this.take.step
    const p = [0, 1, 2].map(c => mesh.rest[3 * v + c] + (residual ? step * residual[at + c] : 0))
    for (let row = 0; row < 3; row++) {
      out[row] = pose[3 * row] * p[0] + pose[3 * row + 1] * p[1] + pose[3 * row + 2] * p[2] + pose[9 + row]
    }
    return out
  }

  // ---------------------------------------------------------------- colours

  paint(by) {
    this.by = by
    const panel = this.take.header.panels[by], shades = panel?.colours.map(rgbOf)
    for (const mesh of this.meshes) {
      mesh.material = by === 'itself' ? mesh.finish : this.bare
      const colour = mesh.geometry.attributes.color
      for (let v = 0; v < mesh.surface.count; v++) {
        const part = mesh.ofVertex[v]
        colour.array.set(by === 'itself' ? (mesh.own ? mesh.own.subarray(3 * v, 3 * v + 3) : [1, 1, 1])
          : shades && part >= 0 ? shades[part] : BARE.map(linear), 3 * v)
      }
      colour.needsUpdate = true
    }
    const t = this.frame
    this.frame = -1
    if (t >= 0) this.show(t)
  }

  // A colour of the scale from 0 to 1, linear light, into out[at ..].
  scale(share, out, at) {
    const ramp = this.take.header.ramp, x = Math.min(Math.max(share, 0), .99999) * (ramp.length - 1), k = x | 0, f = x - k
    for (let c = 0; c < 3; c++) out[at + c] = linear((ramp[k][c] * (1 - f) + ramp[k + 1][c] * f) / 255)
  }

  paintStress(mesh, stress) {
    const colour = mesh.geometry.attributes.color, {start, count} = mesh.surface
    const own = this.topOf('stress'), shown = this.tops.stress || own || 1
    for (let v = 0; v < count; v++) this.scale((stress[start + v] / 255) ** 2 * own / shown, colour.array, 3 * v)
    colour.needsUpdate = true
  }

  paintSpeed(t) {
    const top = this.tops.speed || this.topOf('speed') || 1, last = this.take.times.length - 1
    if (last < 1) return
    const a = Math.min(t, last - 1), length = this.take.times[a + 1] - this.take.times[a], p = [0, 0, 0], q = [0, 0, 0]
    for (const mesh of this.meshes) {
      const colour = mesh.geometry.attributes.color
      for (let v = 0; v < mesh.surface.count; v++) {
        this.where(mesh, v, a, p); this.where(mesh, v, a + 1, q)
        this.scale(Math.hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]) / length / top, colour.array, 3 * v)
      }
      colour.needsUpdate = true
    }
  }

  // Where this run's own scale ends: of speeds [m/s] or stresses [Pa].
  topOf(by) { return by === 'speed' ? this.fastestSeen() : this.liveTop ?? this.take.header.video?.stress ?? 0 }

  // Where the scale of speeds ends: the fastest 0.5 % of some vertices over all frames are above [m/s].
  fastestSeen() {
    if (this.fastest !== null) return this.fastest
    const times = this.take.times, found = [], p = [0, 0, 0], q = [0, 0, 0]
    for (let t = 0; t + 1 < times.length; t++) {
      for (const mesh of this.meshes) {
        for (let v = 0; v < mesh.surface.count; v += Math.max(1, (mesh.surface.count / 50) | 0)) {
          this.where(mesh, v, t, p); this.where(mesh, v, t + 1, q)
          found.push(Math.hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]) / (times[t + 1] - times[t]))
        }
      }
    }
    found.sort((a, b) => a - b)
    return this.fastest = found[Math.floor(.995 * (found.length - 1))] ?? 0
  }

  // ---------------------------------------------------------------- objects and parts

  reveal(object, on) {
    if (on) this.hidden.delete(object); else this.hidden.add(object)
    this.unveil()
  }

  // What was dropped into a scene is not there before.
  seen(object) {
    const since = this.take.header.video?.since[object]
    return !this.hidden.has(object) && !(since > (this.take.times[this.frame] ?? 0) - 1e-9)
  }

  unveil() {
    if (this.splats && this.frame >= 0) this.take.header.objects.forEach((_, k) => this.splats.place(k, this.take.instant(k, this.frame), this.take.step, !this.seen(k)))
    for (const mesh of [...this.meshes, ...this.overlay]) mesh.visible = this.seen(mesh.surface.object) }

  // Lay a tint over one part; null: over none.
  mark(part) {
    for (const mesh of this.overlay) { this.scene.remove(mesh); mesh.geometry.dispose() }
    this.overlay = []
    if (part === null) return
    for (const mesh of this.meshes) {
      const corners = [], index = mesh.geometry.index.array
      mesh.ofTriangle.forEach((p, t) => { if (p === part) corners.push(index[3 * t], index[3 * t + 1], index[3 * t + 2]) })
      if (!corners.length) continue
      const shape = new THREE.BufferGeometry()
      shape.setAttribute('position', mesh.geometry.attributes.position)
      shape.setIndex(corners)
      const tint = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({color: ACCENT, transparent: true, opacity: .28,
        depthWrite: false, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2, side: THREE.DoubleSide}))
      tint.surface = mesh.surface
      tint.matrix = mesh.matrix
      tint.frustumCulled = tint.matrixAutoUpdate = false
      tint.visible = this.seen(mesh.surface.object)
      this.overlay.push(tint)
      this.scene.add(tint)
    }
  }

  // The nearest surface on a ray: its object, part and the point [m]; null: none.
  meet(ray) {
    for (const mesh of this.meshes) mesh.updateMatrixWorld(true)
    const hit = ray.intersectObjects(this.meshes.filter(mesh => mesh.visible))[0]
    return hit ? {object: hit.object.surface.object, part: hit.object.ofTriangle[hit.faceIndex], point: hit.point} : null
  }
}
