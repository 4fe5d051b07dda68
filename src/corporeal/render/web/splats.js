// Gaussians that were learned from pictures, drawn as soft ellipses from back to front.
// A mean moves like the nearest vertex of its object; the ellipsoid turns with the object's pose.

import * as THREE from './three.min.js'

const TEXELS = 3 // of four numbers each, per Gaussian
const WIDE = 3 * 512 // of the texture [texels]
const BINS = 65536 // of depths, for sorting
const TURNED = .9995 // cosine between views below which they are sorted again

const SEEN = `
uniform highp sampler2D data;
uniform vec2 size; // of the picture [px]
in float which;
out vec2 at; // in standard deviations
out vec4 tint;
vec4 texel(int i) { return texelFetch(data, ivec2(i % ${WIDE}, i / ${WIDE}), 0); }
void main() {
  int i = ${TEXELS} * int(which);
  vec4 a = texel(i), b = texel(i + 1), c = texel(i + 2);
  vec4 eye = viewMatrix * vec4(a.xyz, 1.0);
  float z = -eye.z, f = projectionMatrix[1][1] * size.y * .5;
  gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // outside of what is seen
  if (z < 1e-6 || a.w <= 0.0) return;
  // Covariance in pixels: J W S (J W)^T, with the Jacobian of the perspective at the mean (Zwicker et al. 2001).
  mat3 S = mat3(b.x, b.y, b.z, b.y, b.w, c.x, b.z, c.x, c.y);
  mat3 J = mat3(f / z, 0.0, 0.0, 0.0, f / z, 0.0, f * eye.x / (z * z), f * eye.y / (z * z), 0.0);
  mat3 T = J * mat3(viewMatrix), C = T * S * transpose(T);
  float p = C[0][0] + .3, q = C[0][1], r = C[1][1] + .3;
  float mid = .5 * (p + r), rad = sqrt(.25 * (p - r) * (p - r) + q * q);
  vec2 one = abs(q) > 1e-6 ? normalize(vec2(q, mid + rad - p)) : p >= r ? vec2(1.0, 0.0) : vec2(0.0, 1.0);
  at = 3.0 * position.xy;
  vec2 px = at.x * min(sqrt(mid + rad), 1024.0) * one + at.y * min(sqrt(max(mid - rad, .1)), 1024.0) * vec2(-one.y, one.x);
  gl_Position = projectionMatrix * eye;
  gl_Position.xy += 2.0 * px / size * gl_Position.w;
  int rgb = int(c.z);
  tint = vec4(float(rgb & 255), float((rgb >> 8) & 255), float(rgb >> 16), 255.0 * a.w) / 255.0;
}`
const SHADE = `
in vec2 at;
in vec4 tint;
out vec4 shade;
void main() {
  float alpha = tint.a * exp(-.5 * dot(at, at));
  if (alpha < 1.0 / 255.0) discard;
  shade = vec4(tint.rgb, alpha);
}`

export class Splats {
  constructor(take) {
    const told = take.header.splats
    Object.assign(this, {take, count: told.count, mean: take.array(told.mean), covariance: take.array(told.covariance),
      owner: take.array(told.object), vertex: take.array(told.vertex)})
    const colour = take.array(told.colour), n = this.count
    this.tall = Math.max(Math.ceil(TEXELS * n / WIDE), 1)
    this.data = new Float32Array(4 * WIDE * this.tall)
    for (let i = 0; i < n; i++) {
      const to = 12 * i
      this.data.set(this.mean.subarray(3 * i, 3 * i + 3), to)
      this.data[to + 3] = colour[4 * i + 3] / 255
      this.data.set(this.covariance.subarray(6 * i, 6 * i + 6), to + 4)
      this.data[to + 10] = colour[4 * i] + 256 * colour[4 * i + 1] + 65536 * colour[4 * i + 2]
    }
    this.opacity = Float32Array.from({length: n}, (_, i) => colour[4 * i + 3] / 255)
    this.texture = new THREE.DataTexture(this.data, WIDE, this.tall, THREE.RGBAFormat, THREE.FloatType)
    this.texture.needsUpdate = true
    const shape = new THREE.InstancedBufferGeometry()
    shape.setAttribute('position', new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), 3))
    shape.setIndex([0, 1, 2, 0, 2, 3])
    this.order = new THREE.InstancedBufferAttribute(Float32Array.from({length: n}, (_, i) => i), 1)
    shape.setAttribute('which', this.order)
    shape.instanceCount = n
    this.material = new THREE.ShaderMaterial({glslVersion: THREE.GLSL3, vertexShader: SEEN, fragmentShader: SHADE, transparent: true,
      depthWrite: false, depthTest: true, fog: false, uniforms: {data: {value: this.texture}, size: {value: new THREE.Vector2()}}})
    this.mesh = new THREE.Mesh(shape, this.material)
    this.mesh.frustumCulled = false
    this.depth = new Float32Array(n)
    this.bin = new Uint16Array(n)
    this.first = new Uint32Array(BINS + 1)
    this.looked = null
  }

  // Put those of object k where it is; step: of residuals [m].
  place(k, {pose, residual}, step, hidden) {
    const [a, b, c, d, e, f, g, h, i, x, y, z] = pose, {data, mean, covariance: s, owner, vertex} = this
    for (let n = 0; n < this.count; n++) {
      if (owner[n] !== k) continue
      const to = 12 * n, v = 3 * vertex[n]
      let px = mean[3 * n], py = mean[3 * n + 1], pz = mean[3 * n + 2]
      if (residual) { px += step * residual[v]; py += step * residual[v + 1]; pz += step * residual[v + 2] }
      data[to] = a * px + b * py + c * pz + x
      data[to + 1] = d * px + e * py + f * pz + y
      data[to + 2] = g * px + h * py + i * pz + z
      data[to + 3] = hidden ? 0 : this.opacity[n]
      // R S Rᵀ, first M = R S
      const xx = s[6 * n], xy = s[6 * n + 1], xz = s[6 * n + 2], yy = s[6 * n + 3], yz = s[6 * n + 4], zz = s[6 * n + 5]
      const m0 = a * xx + b * xy + c * xz, m1 = a * xy + b * yy + c * yz, m2 = a * xz + b * yz + c * zz
      const m3 = d * xx + e * xy + f * xz, m4 = d * xy + e * yy + f * yz, m5 = d * xz + e * yz + f * zz
      const m6 = g * xx + h * xy + i * xz, m7 = g * xy + h * yy + i * yz, m8 = g * xz + h * yz + i * zz
      data[to + 4] = m0 * a + m1 * b + m2 * c
      data[to + 5] = m0 * d + m1 * e + m2 * f
      data[to + 6] = m0 * g + m1 * h + m2 * i
      data[to + 7] = m3 * d + m4 * e + m5 * f
      data[to + 8] = m3 * g + m4 * h + m5 * i
      data[to + 9] = m6 * g + m7 * h + m8 * i
    }
    this.texture.needsUpdate = true
    this.looked = null
  }

  // Before a picture: how large it is [px], and who is behind whom.
  aim(eye, wide, tall) {
    this.material.uniforms.size.value.set(wide, tall)
    const ahead = eye.getWorldDirection(new THREE.Vector3())
    if (this.looked && ahead.dot(this.looked) > TURNED) return
    this.looked = ahead
    this.sort(ahead)
  }

  // The farthest first: counted into bins of depth along the view.
  sort({x, y, z}) {
    const {data, depth, bin, first, count} = this
    let low = Infinity, high = -Infinity
    for (let n = 0; n < count; n++) {
      const d = depth[n] = x * data[12 * n] + y * data[12 * n + 1] + z * data[12 * n + 2]
      if (d < low) low = d
      if (d > high) high = d
    }
    const scale = (BINS - 1) / Math.max(high - low, 1e-9)
    first.fill(0)
    for (let n = 0; n < count; n++) {
      bin[n] = (high - depth[n]) * scale
      first[bin[n] + 1]++
    }
    for (let k = 0; k < BINS; k++) first[k + 1] += first[k]
    for (let n = 0; n < count; n++) this.order.array[first[bin[n]]++] = n
    this.order.needsUpdate = true
  }

  free() { this.mesh.geometry.dispose(); this.material.dispose(); this.texture.dispose() }
}
