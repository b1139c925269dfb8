!> The reference of the case file: each variable of each group by the reading procedures.
module reference_m
  use description_m, only: group_description_t, variable_t, choices
  use string_builder_m, only: string_builder_t
  use case_input_m, only: describe_groups
  use errors_m, only: problems_t, to_text
  use schema_m, only: schema_text
  use value_text_m, only: lower_case, nearest_name, printable
  implicit none
  private
  public :: reference_text

  integer, parameter :: width = 96    !! columns of the help

contains

  !> The help on a topic: all groups in a line each (''), the variables of one group (its name),
  !! the page of docs/reference.md ('markdown') or the schema for editors ('json'). Another topic
  !! is a problem, reported with the nearest group.
  function reference_text(topic, problems) result(text)
    character(*), intent(in) :: topic
    type(problems_t), intent(inout) :: problems   !! gets an unknown topic
    character(:), allocatable :: text
    type(group_description_t), allocatable :: groups(:)
    integer :: g

    groups = describe_groups()
    select case (topic)
    case (''); text = list_text(groups)
    case ('markdown'); text = page_text(groups)
    case ('json'); text = schema_text(groups)
    case default
      text = ''
      do g = 1, size(groups)
        if (groups(g)%name == lower_case(topic)) text = group_text(groups(g))
      end do
      if (len(text) == 0) then
        call problems%add_message('unknown group '''//printable(topic)//'''; the nearest is ' &
          //nearest_name(printable(topic), groups%name)//' (--help lists all)')
      end if
    end select
  end function reference_text

  !> All groups, a line each.
  pure function list_text(groups) result(text)
    type(group_description_t), intent(in) :: groups(:)
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    character(:), allocatable :: name
    integer :: g

    call lines%add_line('Groups of a case (* any number); --help GROUP lists the variables:')
    do g = 1, size(groups)
      name = trim(groups(g)%name)
      if (groups(g)%repeated) name = name//' *'
      call lines%add_line('  '//name//repeat(' ', 12 - len(name))//groups(g)%meaning)
    end do
    text = lines%text()
  end function list_text

  !> All variables of a group, a paragraph each.
  pure function group_text(group) result(text)
    type(group_description_t), intent(in) :: group
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    integer :: i, indent

    call lines%add_line('&'//trim(group%name)//': '//group%meaning)
    if (group%repeated) call lines%add_line('A case may hold any number of these groups.')
    indent = 0
    do i = 1, group%n
      indent = max(indent, len(group%variable(i)%name) + 4)
    end do
    do i = 1, group%n
      associate (variable => group%variable(i))
        call lines%add_line('')
        call lines%add_line('  '//variable%name//repeat(' ', indent - 2 - len(variable%name)) &
          //wrapped(values(variable, with_unit=.true.)//'; '//default_words(variable), indent))
        call lines%add_line(repeat(' ', indent)//wrapped(variable%meaning, indent))
        call lines%add_line(repeat(' ', indent)//'example: '//variable%example)
      end associate
    end do
    text = lines%text()
  end function group_text

  !> Text in lines of `width` columns; all but the first begin with `indent` blanks.
  pure function wrapped(text, indent) result(lines)
    character(*), intent(in) :: text
    integer, intent(in) :: indent
    character(:), allocatable :: lines
    integer :: first, last

    lines = ''
    first = 1
    do while (len(text) - first >= width - indent)
      last = first - 1 + index(text(first:first + width - indent), ' ', back=.true.)
      if (last < first) exit
      lines = lines//text(first:last - 1)//new_line('a')//repeat(' ', indent)
      first = last + 1
    end do
    lines = lines//text(first:)
  end function wrapped

  !> The page with a table for each group.
  pure function page_text(groups) result(text)
    type(group_description_t), intent(in) :: groups(:)
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    integer :: g, i

    call lines%add_line('# The case file: every group and variable')
    call lines%add_line('')
    call lines%add_line('Written by `make reference` from the lines of `src/case` that read and ' &
      //'check a case; do not edit.')
    call lines%add_line('`./mics --help GROUP` prints the same. `docs/mics-case.schema.json` ' &
      //'holds it as a JSON schema: the')
    call lines%add_line('page of `mics-tools report` takes the defaults from it, and ' &
      //'Python checks a case by it with the')
    call lines%add_line('packages f90nml and jsonschema:')
    call lines%add_line('')
    call lines%add_line('```python')
    call lines%add_line('import json, f90nml, jsonschema')
    call lines%add_line("case = f90nml.read('input/blocks.nml')")
    call lines%add_line('case = {k: [dict(g) for g in v] if isinstance(v, list) else dict(v)')
    call lines%add_line('        for k, v in case.items()}')
    call lines%add_line("jsonschema.validate(case, json.load(open('docs/mics-case.schema.json')))")
    call lines%add_line('```')
    call lines%add_line('')
    call lines%add_line('SI units; angles in degrees where a name ends in `_deg`.')
    do g = 1, size(groups)
      call lines%add_line('')
      call lines%add_line('## &'//trim(groups(g)%name))
      call lines%add_line('')
      call lines%add(capital(groups(g)%meaning))
      if (groups(g)%repeated) call lines%add('; a case may hold any number of these groups')
      call lines%add_line('.')
      call lines%add_line('')
      call lines%add_line('| variable | values | default | unit | meaning | example |')
      call lines%add_line('|---|---|---|---|---|---|')
      do i = 1, groups(g)%n
        call lines%add_line(table_row(groups(g)%variable(i)))
      end do
    end do
    text = lines%text()
  end function page_text

  !> A sentence with its first letter a capital one.
  pure function capital(text) result(sentence)
    character(*), intent(in) :: text
    character(:), allocatable :: sentence

    sentence = text
    if (text(1:1) >= 'a' .and. text(1:1) <= 'z') sentence(1:1) = achar(iachar(text(1:1)) - 32)
  end function capital

  !> A variable as a row of a table.
  pure function table_row(variable) result(row)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: row
    character(:), allocatable :: default, unit

    default = default_words(variable)
    if (.not. variable%required .and. len(variable%value) > 0) default = '`'//variable%value//'`'
    unit = ''
    if (variable%kind == 'number') unit = variable%allowed%unit
    row = '| `'//variable%name//'` | '//values(variable, with_unit=.false.)//' | '//default//' | ' &
      //unit//' | '//variable%meaning//' | `'//variable%example//'` |'
  end function table_row

  !> The default, or why there is none.
  pure function default_words(variable) result(words)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: words

    if (variable%required) then
      words = 'required'
    else if (len(variable%value) > 0) then
      words = 'default '//variable%value
    else
      words = 'no default'
    end if
  end function default_words

  !> What a variable may be.
  pure function values(variable, with_unit) result(words)
    type(variable_t), intent(in) :: variable
    logical, intent(in) :: with_unit
    character(:), allocatable :: words

    select case (variable%kind)
    case ('choice'); words = choices(variable%choices)
    case ('logical'); words = '.true. or .false.'
    case ('number')
      associate (allowed => variable%allowed)
        words = 'number'
        if (allowed%whole) words = 'whole number'
        if (variable%most > 1) words = to_text(variable%most)//' '//words//'s'
        if (allowed%fewest > 0) words = to_text(allowed%fewest)//' to '//words
        if (with_unit .and. len(allowed%unit) > 0) words = words//' ['//allowed%unit//']'
        if (allowed%bounded_below()) words = words//', '//allowed%words()
      end associate
    case default
      words = variable%kind
      if (variable%most > 1) words = '1 to '//to_text(variable%most)//' '//words//'s'
    end select
  end function values

end module reference_m
