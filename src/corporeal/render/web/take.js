// A take (render/recording_format.py): header, arrays, and where every vertex is in every frame. Knows no WebGL.

const KINDS = {f4: Float32Array, u4: Uint32Array, u2: Uint16Array, i2: Int16Array, i1: Int8Array, u1: Uint8Array}
const SIGNED = 127 // octahedral normals

export class Take {
  constructor(buffer) {
    const length = new DataView(buffer).getUint32(0, true)
    this.buffer = buffer
    this.base = 4 + length
    this.header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)))
    this.step = this.header.step
    const video = this.header.video
    this.times = video ? video.time : []
    this.reels = video ? video.objects.map((reel, k) => this.unreeled(reel, k)) : []
  }

  array([offset, count, kind]) { return new KINDS[kind](this.buffer, this.base + offset, count) }

  unreeled(reel, k) {
    const count = this.times.length
    const whole = (spec, axes, wide) => spec && summed(this.array(spec), count, axes, wide)
    return {
      pose: this.array(reel.pose),
      residual: whole(reel.residual, 3, true),
      normal: whole(reel.normal, 2, false),
      stress: whole(reel.stress, 1, false),
    }
  }

  // The frame whose time is nearest.
  nearest(time) {
    let low = 0, high = this.times.length - 1
    while (high - low > 1) { const mid = (low + high) >> 1; if (this.times[mid] <= time) low = mid; else high = mid }
    return time - this.times[low] <= this.times[high] - time ? low : high
  }

  // What object k is in frame t: views into the recording, no copies.
  instant(k, t) {
    const reel = this.reels[k], n = this.header.objects[k].vertices
    return {
      pose: reel.pose.subarray(12 * t, 12 * t + 12),
      residual: reel.residual?.subarray(3 * n * t, 3 * n * (t + 1)),
      normal: reel.normal?.subarray(2 * n * t, 2 * n * (t + 1)),
      stress: reel.stress?.subarray(n * t, n * (t + 1)),
    }
  }
}

// Bytes apart -> axes apart -> sums over time -> [frame][vertex][axis]. Sums wrap around, as the differences did.
function summed(bytes, count, axes, wide) {
  const total = wide ? bytes.length / 2 : bytes.length
  const out = wide ? new Int16Array(total) : axes === 1 ? new Uint8Array(total) : new Int8Array(total)
  const perAxis = total / axes, rows = perAxis / count, frame = rows * axes
  for (let axis = 0; axis < axes; axis++) {
    for (let t = 0; t < count; t++) {
      for (let v = 0; v < rows; v++) {
        const from = axis * perAxis + t * rows + v, to = t * frame + v * axes + axis
        const change = wide ? bytes[from] | (bytes[total + from] << 8) : bytes[from]
        out[to] = change + (t ? out[to - frame] : 0)
      }
    }
  }
  return out
}

// Two bytes back to a unit vector, written to out[at .. at + 2].
export function unfold(a, b, out, at) {
  let x = a / SIGNED, y = b / SIGNED
  const z = 1 - Math.abs(x) - Math.abs(y), below = Math.max(-z, 0)
  x -= x >= 0 ? below : -below
  y -= y >= 0 ? below : -below
  const length = Math.hypot(x, y, z) || 1
  out[at] = x / length; out[at + 1] = y / length; out[at + 2] = z / length
}

// A block that was deflated and written as base64.
export async function inflated(text) {
  const raw = Uint8Array.from(atob(text), letter => letter.charCodeAt(0))
  return new Response(new Blob([raw]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer()
}
