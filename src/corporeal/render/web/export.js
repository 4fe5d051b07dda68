// Export: the run for other tools, as a zip.

import { el } from './cards.js'
import { post } from './change.js'

const FORMATS = [['glb', 'animated glTF video (GLB)', 'Blender, three.js, any glTF viewer'], ['usd', 'OpenUSD', 'Omniverse, Houdini; with UsdPhysics'],
  ['mjcf', 'MuJoCo (MJCF)', 'with mass, inertia, friction'], ['urdf', 'URDF', 'robot simulators'], ['npz', 'NumPy arrays', 'every particle in every frame'],
  ['h5', 'HDF5', 'needs corporeal[export]'], ['abc', 'Alembic', 'needs corporeal[export]'], ['splats', 'moving splats', 'of runs from splats or pictures']]

export class Export {
  constructor(run) {
    this.run = run
    this.said = el('div', {'aria-live': 'polite'})
    this.buttons = FORMATS.map(([target, name, what]) => el('div', {class: 'line'}, el('span', {}, el('b', {}, name), el('br'), el('small', {}, what)),
      el('button', {'aria-label': `export to ${name}`, onclick: () => this.write(target, name)}, 'Export')))
    this.content = el('div', {}, el('p', {}, 'The scene with what it is made of, and how it moved, for other tools. The files also lie in the run’s folder, under export.'),
      ...this.buttons, this.said)
  }

  async write(target, name) {
    const all = this.buttons.map(row => row.querySelector('button'))
    for (const button of all) button.disabled = true
    this.said.replaceChildren(el('p', {class: 'note'}, `Writing ${name} …`))
    const answer = await post('/export', {run: this.run, to: target}).catch(() => ({error: 'The server does not answer.'}))
    for (const button of all) button.disabled = false
    if (answer.error) { this.said.replaceChildren(el('p', {class: 'bad', role: 'alert'}, answer.error)); return }
    this.said.replaceChildren(el('p', {}, el('a', {class: 'do', href: `/exported/${encodeURIComponent(this.run)}/${target}`, download: `${this.run}-${target}.zip`}, `Save ${this.run}-${target}.zip`)),
      el('p', {}, `${answer.files.length} file${answer.files.length === 1 ? '' : 's'}.`),
      ...(answer.unsaid.length ? [el('p', {}, 'What this format cannot say:'), el('ul', {}, answer.unsaid.map(sentence => el('li', {}, sentence)))] : []))
    this.said.scrollIntoView({block: 'nearest'})
  }
}
