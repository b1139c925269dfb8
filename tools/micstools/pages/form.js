'use strict';
// The form of a case, made of the schema that the program prints: physics first, then a part for
// each group, a field for each variable with its unit, its default and what it means.

const BRIEF = ['title', 'name', 'kind', 'shape', 'file', 'position']; // of a group that is closed
const OPEN = 4; // groups of one name that are open at first
const FIRST = ['run', 'physics']; // stands above all groups

// An element; attributes that are null are left out.
function make(name, attributes, ...content) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value != null) element.setAttribute(key, value);
  element.append(...content.filter(part => part != null));
  return element;
}

// A value as one would type it, without quotes.
const typed = value => Array.isArray(value) ? value.map(typed).join(', ')
  : typeof value === 'boolean' ? `.${value}.` : `${value ?? ''}`;

class Form {
  constructor(schema, physics) {
    Object.assign(this, { schema, physics, groups: schema.$defs });
  }

  repeats(group) { return 'anyOf' in this.schema.properties[group]; }

  // Variables that a group must have, where there are several ways by the first.
  needed(group) {
    const about = this.groups[group];
    return (about.anyOf ? about.anyOf[0] : about).required || [];
  }

  // All groups, those of the case with their fields, the others to be added. `values`: what is typed
  // in each group, in order; none where it cannot be read.
  build(values) {
    const parts = Object.entries(this.groups).map(([group, about]) => {
      const here = values.filter(found => found.group === group);
      const add = this.repeats(group) || !here.length ? make('button', { type: 'button', 'data-add': group }, `add &${group}`) : null;
      return make('section', { class: 'group-part', id: `g-${group}` },
        make('h3', {}, `&${group} `, make('small', {}, about.description || '')),
        ...here.map(found => this.instance(found, here.length)), add);
    });
    const run = values.find(found => found.group === FIRST[0] && found.values);
    if (run) parts.unshift(make('section', { class: 'group-part' }, this.field(run, FIRST[1]), this.physics));
    const names = values.filter(found => found.group === 'shape' && found.values && found.values.name);
    const known = make('datalist', { id: 'shapes' }, ...names.map(found => make('option', { value: found.values.name })));
    return make('form', { autocomplete: 'off', novalidate: '' }, ...parts, known);
  }

  // One group of the case.
  instance({ group, n, values }, of) {
    const wrong = () => make('p', { class: 'wrong', 'data-of': `${group}.${n}` });
    if (!values) return make('div', {}, 'This group cannot be read: mend it in the text.', wrong());
    const first = ([name]) => group !== FIRST[0] || name !== FIRST[1] || n > 0, needed = this.needed(group);
    const names = Object.entries(this.groups[group].properties).filter(first).map(([name]) => name);
    const shown = names.filter(name => needed.includes(name) || name in values);
    const others = names.filter(name => !shown.includes(name));
    const fields = chosen => chosen.map(name => this.field({ group, n, values }, name));
    const button = (word, name) => make('button', { type: 'button', [`data-${name}`]: group, 'data-n': n }, word);
    const several = this.repeats(group), brief = BRIEF.map(name => values[name]).filter(Boolean).join(' · ').slice(0, 60);
    const summary = make('summary', {}, make('b', {}, `&${group}${several ? ` ${n + 1}` : ''}`), ' ', make('span', {}, brief),
      make('span', { class: 'tools' }, several ? button('copy', 'copy') : null, button('remove', 'remove')));
    const more = make('details', { class: 'more' }, make('summary', {}, `${others.length} more`), ...fields(others));
    return make('details', { class: 'instance', open: of <= OPEN ? '' : null }, summary, wrong(), ...fields(shown),
      others.length ? more : null);
  }

  field({ group, n, values }, name) {
    const about = this.groups[group].properties[name], unit = about.unit || '-', key = `${group}-${n}-${name}`;
    const needed = this.needed(group).includes(name), usual = typed(about.default);
    const more = needed ? '; must be given' : usual ? `; default ${usual}` : '';
    return make('label', { class: 'field' },
      make('span', {}, name, unit === '-' ? null : make('small', {}, ` [${unit}]`)),
      this.control(about, values[name] || '', needed, name, { 'data-group': group, 'data-n': n, 'data-variable': name,
        'aria-describedby': `${key}-wrong`, id: key }),
      make('small', { class: 'wrong', id: `${key}-wrong`, role: 'alert' }),
      make('small', { class: 'hint-of' }, `${about.description || ''}${more}`));
  }

  control(about, value, needed, name, ours) {
    const choices = about.type === 'boolean' ? ['.true.', '.false.'] : about.enum, usual = typed(about.default);
    if (!choices) {
      const shown = usual || typed((about.examples || [])[0]);
      return make('input', { type: 'text', value, placeholder: shown, list: name === 'shape' ? 'shapes' : null, spellcheck: 'false', ...ours });
    }
    const listed = value && !choices.includes(value) ? [...choices, value] : choices; // a wrong one stays
    return make('select', ours, make('option', { value: '' }, needed ? 'choose …' : `default: ${usual || 'none'}`),
      ...listed.map(option => make('option', { value: option, selected: option === value ? '' : null }, option)));
  }
}
