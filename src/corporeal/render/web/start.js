// The page of one run, or of two: fetch what there is to play, then show it.

import { Take } from './take.js'
import { Viewer } from './page.js'
import { Change } from './change.js'
import { Touch } from './touch.js'
import { el } from './cards.js'

const root = document.getElementById('view'), names = location.pathname.split('/').slice(2).map(decodeURIComponent)

async function fetched(name) {
  const answer = await fetch(`/take/${encodeURIComponent(name)}`)
  if (!answer.ok) throw new Error((await answer.json()).error)
  return new Take(await answer.arrayBuffer())
}

try {
  document.title = `${names.join(' beside ')} · corporeal`
  const [takes, {read_only, works}] = await Promise.all([Promise.all(names.map(fetched)), fetch('/runs').then(a => a.json())])
  let touch = null
  const tabs = viewer => {
    if (read_only || names.length > 1) return []
    touch = new Touch(viewer, names[0])
    return [['Touch', touch.content], ...(works ? [['Change', new Change(viewer, names[0]).content]] : [])]
  }
  const opened = name => { if (name === 'Touch') touch?.enter(); else touch?.leave() }
  window.viewer = new Viewer(root, takes, {names, home: '/home', tabs, opened})
} catch (error) {
  root.replaceChildren(el('div', {class: 'failed', role: 'alert'}, el('h1', {}, 'This run cannot be shown'), el('p', {}, error.message),
    el('p', {}, el('a', {href: '/home'}, 'All runs'))))
}
