// Touch: the run simulated now, on the server, with interaction.

import * as THREE from './three.min.js'
import { key, el, si, spoken } from './cards.js'
import { post } from './change.js'
import { Take } from './take.js'

const MOVED = 4 // a pointer that moves less is a click [px]
const HEAD = 48 // bytes of a picture before its objects
const WINDS = [0, 2, 5, 10, 20] // [m/s]
const FIRMNESS = [['soft', 2], ['firm', 4], ['hard', 8]] // [Hz]
const HEIGHTS = [.1, .3, 1] // from which things are dropped [m]
const USUAL = 'corporeal/rubber_ball'
const HAND = 0xb5482a
const MOST_LAGS = 2000 // times from an order to its picture that are remembered
const LOOK_AGAIN = 1000 // [ms]
const BESIDE = ['objects slide and part', 'all stick: one grid']

export class Touch {
  constructor(viewer, name) {
    Object.assign(this, {viewer, name, news: null, seq: 0, sent: new Map(), grip: null, placing: false, generation: 0, wanted: 0})
    this.firm = el('select', {'aria-label': 'spring'}, FIRMNESS.map(([word, hz]) => el('option', {value: hz, selected: hz === 4}, word)))
    this.pull = el('input', {type: 'range', min: 0, max: 20, step: .01, value: 9.81, 'aria-label': 'gravity', oninput: () => {
      this.gravityWords.textContent = `${(+this.pull.value).toFixed(2)} m/s²`
      this.tell({do: 'gravity', to: [0, 0, -this.pull.value]})
    }})
    this.gravityWords = el('b', {}, '9.81 m/s²')
    this.who = el('select', {'aria-label': 'object in the wind'})
    this.thing = el('select', {'aria-label': 'thing to drop'})
    this.height = el('select', {'aria-label': 'height of the drop'}, HEIGHTS.map(h => el('option', {value: h, selected: h === .3}, `${h} m`)))
    this.dropIt = el('button', {class: 'do', 'aria-pressed': 'false', onclick: () => this.choosePlace(!this.placing)}, 'Drop it: then click where')
    this.dropWords = el('p', {class: 'hint', 'aria-live': 'polite'})
    this.nameAll(viewer.takes[0])
    this.wind = el('select', {'aria-label': 'wind'}, WINDS.map(w => el('option', {value: w}, `${w} m/s`)))
    const blow = () => {
      const d = viewer.eye.getWorldDirection(new THREE.Vector3()), level = Math.hypot(d.x, d.y) || 1, w = +this.wind.value
      this.tell({do: 'wind', object: +this.who.value, to: [w * d.x / level, w * d.y / level, 0]})
    }
    this.wind.onchange = blow
    this.contact = el('select', {'aria-label': 'contact', onchange: () => {
      const how = this.contact.value
      this.tell({do: 'contact', single: how === 'single', twin: how === 'both'})
    }}, el('option', {value: 'multi'}, BESIDE[0]), el('option', {value: 'both'}, 'both, beside each other'), el('option', {value: 'single'}, `${BESIDE[1]} (control)`))
    this.again = el('div', {'aria-live': 'polite'})
    this.replay = el('button', {class: 'do', onclick: () => this.replayIt()}, 'Replay at draft')
    this.said = el('p', {class: 'bad', role: 'alert'})
    this.honest = el('p', {class: 'note'}, 'Starting …')
    this.card = el('div', {class: 'picked'})
    this.content = el('div', {}, this.honest, this.said,
      el('p', {}, 'Drag an object to pull at it, drag beside it to look around. A click opens its card. Wind blows away from you. What you do here does not change the run.'),
      el('label', {class: 'line'}, 'spring', this.firm),
      el('label', {class: 'line'}, 'gravity', this.pull, this.gravityWords),
      el('label', {class: 'line'}, 'wind on', this.who, this.wind),
      el('label', {class: 'line'}, 'contact', this.contact),
      el('label', {class: 'line'}, 'drop', this.thing), el('label', {class: 'line'}, 'from a height of', this.height), this.dropIt, this.dropWords,
      el('button', {class: 'do', onclick: () => this.tell({do: 'reset'})}, 'Begin again'), ' ', this.replay,
      el('p', {class: 'hint'}, 'Replay at draft: what was done since the beginning is simulated once more, as finely as a draft, and the control beside it. It takes minutes.'),
      this.again, this.card)
    this.line = new THREE.Line(new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(new Float32Array(6), 3)),
      new THREE.LineBasicMaterial({color: HAND}))
    this.line.frustumCulled = this.line.visible = false
    viewer.stages[0].scene.add(this.line)
  }

  // List what the wind can blow at.
  nameAll(take) { this.who.replaceChildren(...take.header.objects.map((o, k) => el('option', {value: k}, spoken(o.name)))) }

  // ---------------------------------------------------------------- coming and going

  enter() {
    const viewer = this.viewer
    if (viewer.live) return
    viewer.live = this
    viewer.state.textContent = 'live'
    if (viewer.by.value === 'speed') { viewer.by.value = 'itself'; viewer.paint('itself') }
    this.socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/live/${encodeURIComponent(this.name)}`)
    this.socket.binaryType = 'arraybuffer'
    this.socket.onmessage = event => this.hear(event.data)
    this.socket.onclose = () => { if (viewer.live === this) { viewer.state.textContent = 'stopped'; this.said.textContent ||= 'The simulation has ended.' } }
    viewer.playing = true
    viewer.say()
    viewer.mayPlay()
    this.said.textContent = ''
    viewer.hud.textContent = 'Filling the scene again for real time …'
    this.socket.onopen = () => this.tell({do: 'play'})
    this.listThings()
  }

  async listThings() {
    const {models, runs} = await fetch('/things').then(answer => answer.json()).catch(() => ({models: [], runs: []}))
    const chosen = this.thing.value || USUAL, option = (value, words) => el('option', {value, selected: value === chosen}, spoken(words))
    const ofRun = ({run, objects}) => objects.length ? el('optgroup', {label: run === this.name ? 'this run' : `run ${run}`}, objects.map(o => option(`${run}/${o}`, o))) : null
    const mine = runs.filter(r => r.run === this.name), rest = runs.filter(r => r.run !== this.name)
    this.thing.replaceChildren(...[...mine.map(ofRun), el('optgroup', {label: 'models of corporeal'}, models.map(m => option(m.thing, m.thing.split('/')[1]))), ...rest.map(ofRun)].filter(Boolean))
  }

  leave() {
    const viewer = this.viewer
    if (viewer.live !== this) return
    viewer.live = null
    this.socket?.close()
    this.news = this.rigid = null
    this.choosePlace(false)
    viewer.alone()
    this.showScene(viewer.takes[0], 0)
    this.contact.value = 'multi'
    this.line.visible = false
    viewer.stages[0].liveTop = null
    viewer.state.textContent = viewer.rest
    viewer.mayPlay()
    viewer.honest.textContent = viewer.takes[0].header.honest
    viewer.hud.replaceChildren()
    viewer.stages[0].begin()
    viewer.shownAt = null
    viewer.touch()
  }

  tell(order) {
    if (this.socket?.readyState !== 1) return
    order.seq = ++this.seq
    this.sent.set(this.seq, performance.now())
    this.socket.send(JSON.stringify(order))
  }

  hear(data) {
    if (typeof data !== 'string') { this.news = data; this.viewer.stats.got = (this.viewer.stats.got ?? 0) + 1; return }
    const told = JSON.parse(data)
    if (told.rigid) {
      this.honest.textContent = this.viewer.honest.textContent = told.honest
      if (told.generation === this.generation && told.rigid.length === this.viewer.stages[0].take.header.objects.length) this.rigid = told.rigid
      else this.fetchScene(told.generation, told.rigid)
    }
    if (told.gravity) {
      this.pull.value = -told.gravity[2]
      this.pull.oninput()
    }
    if (told.said !== undefined) { this.said.textContent = told.said; if (told.said) this.dropWords.textContent = '' }
  }

  // The scene has other objects now: until they are here, its pictures are not shown.
  async fetchScene(generation, rigid) {
    this.wanted = generation
    const answer = await fetch(`/lively/${encodeURIComponent(this.name)}`)
    if (!answer.ok || this.viewer.live !== this || this.wanted !== generation || +answer.headers.get('X-Generation') !== generation) return
    const take = new Take(await answer.arrayBuffer())
    if (this.viewer.live !== this || this.wanted !== generation) return
    this.rigid = rigid
    this.showScene(take, generation)
    this.dropWords.textContent = ''
  }

  showScene(take, generation) {
    this.wanted = this.generation = generation
    if (this.viewer.stages[0].take === take) return
    this.viewer.swap(take)
    this.viewer.stages[0].scene.add(this.line)
    this.nameAll(take)
  }

  // ---------------------------------------------------------------- pictures

  tick(viewer) {
    if (!this.news || !this.rigid) return
    const data = new DataView(this.news), buffer = this.news, stage = viewer.stages[0]
    this.news = null
    if (data.getUint32(44, true) !== this.generation) return
    const done = data.getUint32(0, true), rate = data.getFloat32(4, true), force = data.getFloat32(8, true), top = data.getFloat32(12, true)
    viewer.clock = data.getFloat64(16, true)
    const held = [24, 28, 32].map(at => data.getFloat32(at, true)), playing = data.getUint32(36, true) > 0
    if (data.getUint32(40, true) > 1) viewer.beside(BESIDE)
    else viewer.alone()
    if (playing !== viewer.playing) { viewer.playing = playing; viewer.say() }
    if (!stage.liveTop || viewer.stages.some(shown => !shown.liveTop) || Math.abs(top / stage.liveTop - 1) > .02) {
      for (const shown of viewer.stages) shown.liveTop = top
      if (stage.by === 'stress') viewer.legend.replaceChildren(key(stage))
    }
    let at = HEAD
    for (const shown of viewer.stages) stage.take.header.objects.forEach((object, k) => {
      const n = object.vertices, instant = {pose: new Float32Array(buffer, at, 12)}
      at += 48
      if (!this.rigid[k]) {
        instant.residual = new Int16Array(buffer, at, 3 * n)
        instant.normal = new Int8Array(buffer, at + 6 * n, 2 * n)
        instant.stress = new Uint8Array(buffer, at + 8 * n, n)
        at += 4 * Math.ceil(9 * n / 4)
      }
      shown.place(k, instant)
    })
    this.show(held, force)
    for (const [number, then] of this.sent) if (number <= done) { viewer.stats.lag.push(performance.now() - then); this.sent.delete(number) }
    if (viewer.stats.lag.length > MOST_LAGS) viewer.stats.lag.splice(0, MOST_LAGS / 2)
    viewer.stats.frames++
    Object.assign(viewer.stats, {rate, force, time: viewer.clock})
    viewer.clockWords.textContent = `${viewer.clock.toFixed(2)} s`
    viewer.hud.textContent = `${rate.toFixed(2)} × real time${force > 0 ? ` · pull ${si(force, 'N')}` : ''}`
    viewer.touch()
  }

  show(held, force) {
    this.line.visible = Boolean(this.grip?.to) && Number.isFinite(held[0])
    if (!this.line.visible) return
    const points = this.line.geometry.attributes.position
    points.setXYZ(0, ...held)
    points.setXYZ(1, ...this.grip.to)
    points.needsUpdate = true
  }

  // ---------------------------------------------------------------- the hand

  pressed(viewer, event) {
    if (event.button) return
    const {which, hit} = viewer.meet(event)
    if (this.placing) { this.dropAt(viewer, event, hit); return }
    if (!hit || which) return // the control is not touched by itself
    viewer.orbit.enabled = false
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(viewer.eye.getWorldDirection(new THREE.Vector3()), hit.point)
    this.grip = {hit, plane, to: null}
    const moved = later => this.moved(viewer, event, later)
    const released = () => {
      removeEventListener('pointermove', moved)
      removeEventListener('pointerup', released)
      removeEventListener('pointercancel', released)
      if (this.grip?.to) this.tell({do: 'drop'})
      this.grip = null
      this.line.visible = false
      viewer.orbit.enabled = true
      viewer.touch()
    }
    addEventListener('pointermove', moved)
    addEventListener('pointerup', released)
    addEventListener('pointercancel', released)
  }

  // ---------------------------------------------------------------- things from the pool

  choosePlace(on) {
    this.placing = on
    this.dropIt.setAttribute('aria-pressed', String(on))
    this.viewer.canvas.style.cursor = on ? 'crosshair' : ''
    this.dropWords.textContent = on ? 'Click on an object or on the floor: it falls from above that place.' : ''
  }

  // Over what is under the pointer: an object, or the floor.
  dropAt(viewer, event, hit) {
    const point = hit?.point ?? viewer.ray.ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), 0), new THREE.Vector3())
    viewer.orbit.enabled = false
    addEventListener('pointerup', () => { viewer.orbit.enabled = true }, {once: true})
    if (!point) return
    this.choosePlace(false)
    this.said.textContent = ''
    this.dropWords.textContent = `${spoken(this.thing.value.split('/')[1])} is filled for this scene …`
    this.tell({do: 'add', thing: this.thing.value, point: point.toArray(), to: [0, 0, +this.height.value]})
  }

  moved(viewer, first, event) {
    const grip = this.grip
    if (!grip || (!grip.to && Math.hypot(event.clientX - first.clientX, event.clientY - first.clientY) < MOVED)) return
    viewer.aim(event)
    const spot = viewer.ray.ray.intersectPlane(grip.plane, new THREE.Vector3())
    if (!spot) return
    const kind = grip.to ? 'pull' : 'grab'
    grip.to = spot.toArray()
    this.tell({do: kind, object: grip.hit.object, point: grip.hit.point.toArray(), to: grip.to, firm: +this.firm.value})
  }

  // ---------------------------------------------------------------- once more, finer

  async replayIt() {
    this.replay.disabled = true
    const asked = await post('/replay', {run: this.name}).catch(() => ({error: 'The server does not answer.'}))
    if (asked.error) { this.again.replaceChildren(el('p', {class: 'bad', role: 'alert'}, asked.error)); this.replay.disabled = false }
    else this.follow(asked.id)
  }

  // Say how far a replay is until it ends, then where it is seen.
  async follow(id) {
    const {state, fraction, words} = await fetch(`/replays/${id}`).then(answer => answer.json())
    if (state === 'running') {
      const stop = el('button', {onclick: () => post('/replay/stop', {id})}, 'Stop it')
      this.again.replaceChildren(el('label', {class: 'line'}, 'replay', el('progress', {max: 1, value: fraction})), el('p', {}, words, ' ', stop))
      setTimeout(() => this.follow(id), LOOK_AGAIN)
      return
    }
    this.replay.disabled = false
    this.again.replaceChildren(state === 'finished' ? el('p', {}, el('a', {class: 'do', href: `/replayed/${id}`}, 'See the replay, the control beside it'))
      : el('p', {class: 'bad', role: 'alert'}, words))
  }
}
