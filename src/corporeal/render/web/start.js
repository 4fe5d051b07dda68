// The page of one run, or of two: fetch what there is to play, then show it.

import { Take } from './take.js'
import { Viewer } from './page.js'
import { Change, follow, post } from './change.js'
import { Export } from './export.js'
import { Touch } from './touch.js'
import { el } from './cards.js'

const root = document.getElementById('view'), asked = location.pathname.split('/').slice(2).map(decodeURIComponent)
const replayed = location.pathname.startsWith('/replayed/')
const names = replayed ? ['replayed: objects slide and part', 'all stick: one grid'] : asked
const addresses = replayed ? ['multi', 'single'].map(how => `/replayed/${encodeURIComponent(asked[0])}/${how}`) : asked.map(name => `/take/${encodeURIComponent(name)}`)

async function fetched(address) {
  const answer = await fetch(address)
  if (!answer.ok) throw new Error((await answer.json()).error)
  return new Take(await answer.arrayBuffer())
}

// What stands there of a run that has not been simulated.
function simulateIt() {
  const holder = el('div', {'aria-live': 'polite'}), button = el('button', {class: 'do', onclick: async () => {
    button.hidden = true
    const answer = await post('/jobs/run', {run: names[0]})
    if (answer.error) { holder.replaceChildren(el('p', {class: 'bad', role: 'alert'}, answer.error)); button.hidden = false }
    else follow(answer.id, holder, location.pathname, 'Show it', () => {})
  }}, 'Simulate it as it is')
  return el('div', {class: 'note'}, el('p', {}, el('b', {}, 'Not simulated yet.'), ' This is what it is taken for, and how it will begin. Check the materials; wrong ones are changed in the tab Change.'),
    button, holder)
}

try {
  document.title = `${names.join(' beside ')} · corporeal`
  const [takes, {read_only, works}] = await Promise.all([Promise.all(addresses.map(fetched)), fetch('/runs').then(a => a.json())])
  let touch = null
  const tabs = viewer => {
    if (read_only || names.length > 1) return [] // nor of a replay
    touch = new Touch(viewer, names[0])
    return [['Touch', touch.content], ...(works ? [['Change', new Change(viewer, names[0]).content]] : []), ['Export', new Export(names[0]).content]]
  }
  const opened = name => { if (name === 'Touch') touch?.enter(); else touch?.leave() }
  const differs = replayed ? 'Contact alone: on the right all objects share one velocity field, and what touches sticks.' : undefined
  const unmoved = works && names.length === 1 ? simulateIt : null
  window.viewer = new Viewer(root, takes, {names, home: '/home', tabs, opened, unmoved, differs})
} catch (error) {
  root.replaceChildren(el('div', {class: 'failed', role: 'alert'}, el('h1', {}, 'This run cannot be shown'), el('p', {}, error.message),
    el('p', {}, el('a', {href: '/home'}, 'All runs'))))
}
