// The viewer: pictures of one or two runs with one camera and one timeline, and what is known of them beside it.

import * as THREE from './three.min.js'
import { Stage, graphics, squareOf } from './stage.js'
import { auditOf, card, differences, el, key, si, spoken, table } from './cards.js'

const VIEW = [.8, -.62, .36] // three-quarter view, as the video's
const ANGLE = 30 // vertical field of view [deg]
const CLICK = 4 // a pointer that moves less is a click [px]
const PAUSE = .4 // at the end of a recording, before it starts again [s]
const STILL = 300 // a picture that does not change for so long is drawn again with all pixels [ms]
const SPEEDS = [1, .5, .25, .1]
const HELP = [['space', 'play or pause'], ['← →', 'one picture back or on'], ['Home End', 'to the start or the end'], ['0', 'the first view again'],
  ['click a part', 'its card'], ['Escape', 'closes the card'], ['drag', 'look around'], ['wheel, pinch', 'nearer or farther'], ['right drag, two fingers', 'move sideways'],
  ['?', 'this list']]

const NO_3D = 'This browser shows no 3D (WebGL 2 is off). Everything else on this page works.'

export class Viewer {
  constructor(root, takes, options = {}) {
    this.root = root
    this.takes = takes
    this.options = options
    const gpu = graphics(), hard = gpu && !/SwiftShader|llvmpipe|Software/i.test(gpu)
    const asked = new URLSearchParams(location.search)
    this.dense = hard ? Math.min(devicePixelRatio, 2) : .75
    this.stats = {gpu, frames: 0, drawn: 0, lag: [], errors: [], ready: false}
    this.clock = 0
    this.speed = 1
    this.playing = !matchMedia('(prefers-reduced-motion: reduce)').matches
    this.picked = null
    this.live = null
    this.length = Math.max(...takes.map(take => take.times.at(-1) ?? 0), 0)
    const shadows = hard || asked.has('shadows')
    this.stages = takes.map(take => new Stage(take, shadows))
    for (const stage of this.stages) stage.changed = () => this.touch()
    this.build(gpu)
    if (gpu) this.tryToOpen(hard, shadows)
    // Telephones and software renderers begin with surfaces.
    if (hard && takes.some(take => take.header.splats) && matchMedia('(min-width: 800px) and (pointer: fine)').matches) this.soft.click()
    this.paint('itself')
    this.stats.ready = true
  }

  // ---------------------------------------------------------------- the page

  build(gpu) {
    const first = this.takes[0].header
    this.canvas = el('canvas', {tabindex: 0, 'aria-label': 'the scene in 3D: drag to look around, click a part for its card'})
    this.legend = el('div', {class: 'legend', hidden: true})
    this.hud = el('div', {class: 'hud'})
    this.help = el('div', {class: 'help', hidden: true}, el('h3', {}, 'Keys and pointer'), table(HELP))
    this.see = el('div', {class: 'see'}, gpu ? this.canvas : el('p', {class: 'none'}, NO_3D), this.hud, this.legend, this.help,
      this.takes.length > 1 ? this.takes.map((take, k) => el('div', {class: `caption of${k}`}, this.options.names?.[k] ?? take.header.name)) : null)
    this.names = this.takes.map((take, k) => el('b', {}, this.options.names?.[k] ?? take.header.name))
    this.rest = first.video ? 'recorded' : 'not simulated yet' // what is shown while nobody touches
    this.state = el('span', {class: 'state'}, this.rest)
    this.honest = el('span', {class: 'honest'}, first.honest)
    this.panel = el('div', {class: 'panel'})
    this.tabs = el('div', {class: 'tabs', role: 'tablist'})
    this.pages = new Map()
    this.addTab('Look', this.lookTab())
    for (const [name, made] of this.options.tabs?.(this) ?? []) this.addTab(name, made)
    const grave = first.audit?.grave.length ?? 0, warnings = grave + (first.audit?.warnings.length ?? 0)
    this.addTab('Audit', auditOf(first, part => this.openPart(0, part)), warnings)
    this.root.classList.add('viewer')
    this.root.replaceChildren(
      el('div', {class: 'top'}, this.options.home ? el('a', {href: this.options.home}, '← all runs') : null,
        this.names.flatMap((n, k) => k ? [' beside ', n] : [n]), this.state, this.honest,
        grave ? el('button', {class: 'link bad', onclick: () => this.openTab('Audit')}, `contradicts measured values: ${grave}`) : null),
      this.see, el('div', {class: 'side'}, this.tabs, this.panel), this.timeline())
    this.openTab('Look')
    this.root.addEventListener('keydown', event => this.keyed(event))
    if (!this.options.inside) addEventListener('keydown', event => { if (event.target === document.body) this.keyed(event) })
  }

  addTab(name, content, badge = 0) {
    const button = el('button', {role: 'tab', onclick: () => this.openTab(name)}, name, badge ? el('i', {class: 'badge', title: `${badge} warnings`}, String(badge)) : null)
    this.pages.set(name, {button, content})
    this.tabs.append(button)
  }

  openTab(name) {
    this.tab = name
    for (const [other, {button}] of this.pages) button.setAttribute('aria-selected', String(other === name))
    this.panel.replaceChildren(this.pages.get(name).content)
    this.options.opened?.(name)
  }

  lookTab() {
    const header = this.takes[0].header, video = header.video
    const choices = ['itself', 'object', 'material', 'law', 'young_pa', 'density', 'poisson', ...(video ? ['speed'] : []),
      ...(video?.stress > 0 || this.options.tabs ? ['stress'] : [])]
    const words = {young_pa: 'stiffness E', density: 'density ρ', poisson: 'Poisson’s ratio ν', stress: 'stress (von Mises)'}
    this.by = el('select', {'aria-label': 'colour by', onchange: () => this.paint(this.by.value)},
      choices.map(c => el('option', {value: c}, words[c] ?? c)))
    this.card = el('div', {class: 'picked', 'aria-live': 'polite'})
    const objects = header.objects.map((object, k) => {
      const box = el('input', {type: 'checkbox', checked: true, onchange: () => {
        for (const stage of this.stages) stage.reveal(k, box.checked)
        this.touch()
      }, 'aria-label': `show ${spoken(object.name)}`})
      const parts = header.parts.map((part, p) => [part, p]).filter(([part]) => part.object === k)
      return el('div', {class: 'object'}, el('label', {}, box, spoken(object.name), el('small', {}, object.rigid ? ' rigid' : '')),
        parts.map(([part, p]) => el('button', {class: 'part', 'data-part': p, onclick: () => this.openPart(0, p)},
          `${spoken(part.name)}: `, el('b', {}, spoken(part.material)))))
    })
    const splats = this.takes.map(take => take.header.splats).find(Boolean)
    this.soft = el('input', {type: 'checkbox', onchange: () => { if (this.soft.checked) this.by.value = 'itself'; this.paint(this.by.value) }})
    const many = splats && (splats.count < splats.all ? `the ${splats.count.toLocaleString('en')} of ${splats.all.toLocaleString('en')} Gaussians that cover most` : `${splats.count.toLocaleString('en')} Gaussians`)
    const two = this.takes.length > 1 ? differences(...this.takes.map(t => t.header)) : []
    return el('div', {}, video ? null : this.options.unmoved?.() ?? el('p', {class: 'note'}, 'This has not been simulated yet: it stands as it will begin.'),
      el('label', {class: 'line'}, 'colour by', this.by), splats ? [el('label', {class: 'line'}, 'as in the pictures', this.soft), el('p', {class: 'hint'},
        `${many} in place of the surfaces. They move and turn with the objects; only the video stretches them, too.`)] : null,
      el('p', {class: 'hint'}, 'Click a part, here or in the picture, for its material, mass and measured ranges.'),
      el('p', {class: 'hint'}, `Squares on the floor are ${si(squareOf(Math.max(...this.stages.map(s => s.size))), 'm')} wide.`), ...objects,
      this.takes.length > 1 ? [el('h3', {}, 'What differs'), two.length ? table(two, ['part', '', ...this.takes.map((t, k) => this.options.names?.[k] ?? t.header.name)])
        : el('p', {}, this.options.differs ?? 'Nothing that was asked for differs.')] : null,
      this.card)
  }

  timeline() {
    const button = (words, title, act) => el('button', {title, 'aria-label': title, onclick: act}, words)
    this.playButton = button('', 'play or pause (space)', () => this.toggle())
    this.stepButton = button('▶|', 'one picture on (→)', () => this.step(1))
    this.startButton = button('|◀', 'to the start (Home)', () => this.toStart())
    this.at = el('input', {type: 'range', min: 0, max: 1000, value: 0, 'aria-label': 'time', oninput: () => {
      this.pause(); this.clock = this.length * this.at.value / 1000 }})
    this.clockWords = el('span', {class: 'clock'}, '0.00 s')
    this.pace = el('select', {'aria-label': 'speed', onchange: () => { this.speed = +this.pace.value }},
      SPEEDS.map(s => el('option', {value: s}, `${s} ×`)))
    const marks = (this.takes[0].header.marks ?? []).filter(m => m.time <= this.length)
    const ticks = marks.map(m => el('button', {class: 'tick', title: `${spoken(m.what)}, ${m.time.toFixed(3)} s`, 'aria-label': `${spoken(m.what)}, ${m.time.toFixed(3)} s`,
      style: {left: `${100 * m.time / (this.length || 1)}%`}, onclick: () => { this.pause(); this.clock = m.time }}))
    this.say()
    this.mayPlay()
    return el('div', {class: 'time'}, this.playButton, this.stepButton, this.startButton, el('div', {class: 'track'}, this.at, ticks),
      this.clockWords, this.pace)
  }

  // Without a recording there is nothing to play; what runs live has its own pace.
  mayPlay() {
    const stands = !this.live && !this.takes.some(take => take.times.length > 1)
    for (const button of [this.playButton, this.stepButton, this.startButton]) button.disabled = stands
    if (stands) { this.playing = false; this.say() }
    this.at.disabled = stands || Boolean(this.live)
    this.pace.disabled = stands || Boolean(this.live)
  }

  openPart(which, part) {
    const header = this.stages[which].take.header
    this.picked = {which, part}
    this.stages.forEach((stage, k) => stage.mark(k === which ? part : null))
    if (!this.live) this.openTab('Look')
    const holder = this.live?.card ?? this.card
    holder.replaceChildren(card(header.parts[part], header))
    for (const button of this.panel.querySelectorAll('.part')) button.setAttribute('aria-pressed', String(+button.dataset.part === part && which === 0))
    holder.scrollIntoView({block: 'nearest'})
    this.touch()
  }

  closePart() {
    this.picked = null
    for (const stage of this.stages) stage.mark(null)
    for (const holder of [this.card, this.live?.card]) holder?.replaceChildren()
    for (const button of this.panel.querySelectorAll('.part')) button.setAttribute('aria-pressed', 'false')
    this.touch()
  }

  paint(by) {
    if ((by === 'speed' || by === 'stress') && this.stages.length > 1) {
      const top = Math.max(...this.stages.map(stage => stage.topOf(by)))
      for (const stage of this.stages) stage.tops[by] = top // one scale for both
    }
    for (const stage of this.stages) { stage.clad(by === 'itself' && this.soft.checked); stage.paint(by) }
    const made = key(this.stages[0])
    this.legend.hidden = !made
    if (made) this.legend.replaceChildren(made)
    this.touch()
  }

  // ---------------------------------------------------------------- a control beside

  // Show the first run's scene a second time, with a caption for each.
  beside(words) {
    if (this.stages.length > 1) return
    const stage = new Stage(this.stages[0].take, this.renderer.shadowMap.enabled)
    stage.changed = () => this.touch()
    stage.rule(squareOf(stage.size))
    for (const object of this.stages[0].hidden) stage.reveal(object, false)
    this.stages.push(stage)
    stage.paint(this.by.value)
    this.captions = words.map((text, k) => el('div', {class: `caption of${k}`}, text))
    this.see.append(...this.captions)
    this.refit()
  }

  // Show another scene in all pictures, as it begins.
  swap(take) {
    const size = this.stages[0].size
    this.stages = this.stages.map(old => {
      const stage = new Stage(take, this.renderer?.shadowMap.enabled)
      stage.changed = () => this.touch()
      stage.fade(size)
      stage.rule(squareOf(size))
      stage.liveTop = old.liveTop
      for (const object of old.hidden) stage.reveal(object, false)
      old.free()
      return stage
    })
    this.picked = null
    for (const holder of [this.card, this.live?.card]) holder?.replaceChildren()
    this.paint(this.by.value)
  }

  // Show one again.
  alone() {
    if (!this.captions) return
    this.stages.pop().free()
    for (const caption of this.captions) caption.remove()
    this.captions = null
    this.refit()
  }

  // Pictures have another shape now: go back or nearer, so that as much is seen from side to side.
  refit() {
    const before = this.eye.aspect
    this.resize()
    this.eye.position.sub(this.orbit.target).multiplyScalar(before / this.eye.aspect).add(this.orbit.target)
    this.orbit.update()
  }

  // ---------------------------------------------------------------- the picture

  // A browser may say that it draws in 3D and then refuse to: too many pages do, or its driver is barred.
  tryToOpen(hard, shadows) {
    try { this.open(hard, shadows) } catch (error) {
      this.stats.errors.push(error.message)
      this.canvas.replaceWith(el('p', {class: 'none'}, NO_3D))
    }
  }

  open(hard, shadows) {
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, antialias: hard})
    this.renderer.shadowMap.enabled = shadows
    this.renderer.autoClear = false
    const size = Math.max(...this.stages.map(stage => stage.size))
    for (const stage of this.stages) {
      stage.fade(size)
      stage.rule(squareOf(size))
    }
    this.eye = new THREE.PerspectiveCamera(ANGLE, 1, size / 200, size * 40)
    this.eye.up.set(0, 0, 1)
    this.orbit = new THREE.OrbitControls(this.eye, this.canvas)
    this.orbit.maxPolarAngle = .995 * Math.PI / 2
    this.orbit.addEventListener('change', () => this.touch())
    this.ray = new THREE.Raycaster()
    this.ray.layers.enable(1) // surfaces that Gaussians stand for
    new ResizeObserver(() => this.resize()).observe(this.see)
    this.resize()
    this.look()
    this.canvas.addEventListener('pointerdown', event => this.pressed(event), true)
    this.canvas.addEventListener('pointerup', event => this.released(event))
    // A browser takes the graphics away when a laptop sleeps or a driver stalls, and gives them back empty.
    this.canvas.addEventListener('webglcontextrestored', () => this.touch())
    this.last = performance.now()
    this.changed = this.last
    requestAnimationFrame(now => this.tick(now))
  }

  // Stand where everything is seen, from VIEW.
  look() {
    const low = [0, 1, 2].map(k => Math.min(...this.takes.map(t => t.header.low[k])))
    const high = [0, 1, 2].map(k => Math.max(...this.takes.map(t => t.header.high[k])))
    const back = new THREE.Vector3(...VIEW).normalize(), right = new THREE.Vector3(0, 0, 1).cross(back).normalize()
    const up = new THREE.Vector3().crossVectors(back, right), middle = new THREE.Vector3(...low.map((l, k) => (l + high[k]) / 2))
    const tall = Math.tan(ANGLE / 2 * Math.PI / 180), wide = tall * this.eye.aspect
    let away = 0
    for (let corner = 0; corner < 8; corner++) {
      const p = new THREE.Vector3(...low.map((l, k) => corner >> k & 1 ? high[k] : l)).sub(middle), depth = p.dot(back)
      away = Math.max(away, Math.abs(p.dot(right)) / wide + depth, Math.abs(p.dot(up)) / tall + depth)
    }
    this.orbit.target.copy(middle)
    this.eye.position.copy(middle).addScaledVector(back, 1.08 * away)
    this.orbit.update()
    this.touch()
  }

  // Where each run is drawn: beside each other, or one above the other where the picture is tall.
  boxes() {
    const {clientWidth: w, clientHeight: h} = this.see, n = this.stages.length
    return this.stages.map((_, k) => w >= h ? [Math.round(k * w / n), 0, Math.round(w / n), h]
      : [0, Math.round((n - 1 - k) * h / n), w, Math.round(h / n)])
  }

  resize() {
    const {clientWidth: w, clientHeight: h} = this.see
    if (!w || !h) return
    this.setDense(this.dense)
    const [, , wide, tall] = this.boxes()[0]
    this.eye.aspect = wide / tall
    this.eye.updateProjectionMatrix()
    this.touch()
  }

  setDense(ratio) {
    this.ratio = ratio
    this.renderer.setPixelRatio(ratio)
    this.renderer.setSize(this.see.clientWidth, this.see.clientHeight, false)
  }

  touch() { this.dirty = true; this.changed = performance.now() }

  draw() {
    this.renderer.setScissorTest(this.stages.length > 1)
    this.boxes().forEach((box, k) => {
      this.renderer.setViewport(...box)
      this.renderer.setScissor(...box)
      this.renderer.clear()
      this.stages[k].splats?.aim(this.eye, box[2] * this.ratio, box[3] * this.ratio)
      this.renderer.render(this.stages[k].scene, this.eye)
    })
    this.stats.drawn++
  }

  tick(now) {
    const passed = Math.max(now - this.last, 0) / 1000
    this.last = now
    if (this.live) this.live.tick(this)
    else this.play(passed)
    if (this.dirty) {
      if (this.ratio !== this.dense) this.setDense(this.dense)
      this.dirty = false
      this.draw()
    } else if (now - this.changed > STILL && this.ratio < Math.min(devicePixelRatio, 2)) {
      this.setDense(Math.min(devicePixelRatio, 2))
      this.draw()
    }
    requestAnimationFrame(later => this.tick(later))
  }

  // ---------------------------------------------------------------- time

  play(passed) {
    if (this.playing) {
      this.clock += passed * this.speed
      if (this.clock > this.length + PAUSE * this.speed) this.clock = 0
    }
    const time = Math.min(this.clock, this.length)
    let moved = false
    for (const stage of this.stages) {
      if (!stage.take.times.length) continue
      const t = stage.take.nearest(time)
      if (t !== stage.frame) { stage.show(t); this.stats.frames++; moved = true }
    }
    if (moved) this.touch()
    const share = Math.round(1000 * time / (this.length || 1))
    if (share !== this.shownAt) { this.at.value = this.shownAt = share; this.clockWords.textContent = `${time.toFixed(2)} s` }
  }

  step(by) {
    this.pause()
    if (this.live) { if (by > 0) this.live.tell({do: 'step'}); return }
    const times = this.takes[0].times, t = this.takes[0].nearest(Math.min(this.clock, this.length))
    this.clock = times[Math.min(Math.max(t + by, 0), times.length - 1)] ?? 0
  }

  toStart() { if (this.live) this.live.tell({do: 'reset'}); else this.clock = 0 }

  toggle() { if (this.playButton.disabled) return; if (this.playing) this.pause(); else this.resume() }

  pause() { if (this.playing) { this.playing = false; this.live?.tell({do: 'pause'}); this.say() } }

  resume() {
    this.playing = true
    if (!this.live && this.clock >= this.length) this.clock = 0
    this.live?.tell({do: 'play'})
    this.say()
  }

  say() { this.playButton.textContent = this.playing ? '❚❚' : '▶' }

  // ---------------------------------------------------------------- keys and pointer

  keyed(event) {
    if (event.target.matches?.('input, select, textarea') && event.key !== 'Escape') return
    if (event.ctrlKey || event.metaKey || event.altKey) return
    const keys = {' ': () => this.toggle(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => this.toStart(),
      End: () => { if (!this.live) { this.pause(); this.clock = this.length } }, '0': () => this.look(), '?': () => { this.help.hidden = !this.help.hidden },
      Escape: () => { this.help.hidden = true; this.closePart() }}
    if (!keys[event.key] || (event.key === ' ' && event.target.matches?.('button, a'))) return
    event.preventDefault()
    keys[event.key]()
  }

  // Aim the ray at a pointer; returns which run is under it.
  aim(event) {
    const frame = this.canvas.getBoundingClientRect(), x = event.clientX - frame.left, y = frame.height - (event.clientY - frame.top)
    const boxes = this.boxes(), which = Math.max(boxes.findIndex(([l, b, w, h]) => x >= l && x <= l + w && y >= b && y <= b + h), 0)
    const [left, bottom, wide, tall] = boxes[which]
    this.ray.setFromCamera(new THREE.Vector2(2 * (x - left) / wide - 1, 2 * (y - bottom) / tall - 1), this.eye)
    return which
  }

  meet(event) { const which = this.aim(event); return {which, hit: this.stages[which].meet(this.ray)} }

  pressed(event) {
    this.down = {x: event.clientX, y: event.clientY}
    this.canvas.focus({preventScroll: true})
    this.live?.pressed?.(this, event)
  }

  released(event) {
    const down = this.down
    this.down = null
    if (!down || event.button || Math.hypot(event.clientX - down.x, event.clientY - down.y) >= CLICK) return
    const {which, hit} = this.meet(event)
    if (hit && hit.part >= 0) this.openPart(which, hit.part); else this.closePart()
  }
}
