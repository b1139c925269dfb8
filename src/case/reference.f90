!> The reference of the case file: each variable of each group by the reading procedures.
module reference_m
  use allowed_values_m, only: entry_t, choices, words_of
  use group_visitor_m, only: group_visitor_t
  use string_builder_m, only: string_builder_t
  use case_input_m, only: group_names, is_repeated, list_entries
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
    type(group_visitor_t) :: v
    character(12) :: name
    integer :: g

    text = ''
    select case (topic)
    case ('')
      text = 'Groups of a case (* any number); --help GROUP lists the variables:'//new_line('a')
      do g = 1, size(group_names)
        call list_entries(group_names(g), v)
        name = group_names(g)(:12)
        if (is_repeated(g)) name = trim(name)//' *'
        text = text//'  '//name//v%meaning//new_line('a')
      end do
    case ('markdown'); text = page_text()
    case ('json'); text = schema_text()
    case default
      do g = 1, size(group_names)
        if (group_names(g) == lower_case(topic)) text = group_text(g)
      end do
      if (len(text) == 0) call problems%add_message('unknown group '''//printable(topic) &
        //'''; the nearest is '//nearest_name(printable(topic), group_names) &
        //' (--help lists all)')
    end select
  end function reference_text

  !> All variables of a group, a paragraph each.
  function group_text(g) result(text)
    integer, intent(in) :: g
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    type(group_visitor_t) :: v
    integer :: i, indent

    call list_entries(group_names(g), v)
    call lines%add_line('&'//v%group%name//': '//v%meaning)
    if (is_repeated(g)) call lines%add_line('A case may hold any number of these groups.')
    indent = maxval(len_trim(v%entry(:v%n)%name)) + 4
    do i = 1, v%n
      associate (entry => v%entry(i))
        call lines%add_line('')
        call lines%add_line('  '//entry%name(:indent - 2) &
          //wrapped(values(entry, with_unit=.true.)//'; '//default_words(entry), indent))
        call lines%add_line(repeat(' ', indent)//wrapped(entry%meaning, indent))
        call lines%add_line(repeat(' ', indent)//'example: '//entry%example)
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
  function page_text() result(text)
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    type(group_visitor_t) :: v
    character(:), allocatable :: default
    integer :: g, i
    character(*), parameter :: head(*) = [character(98) :: &
      '# The case file: every group and variable', &
      '', &
      'Written by `make reference` from the lines of `src/case` that read and check a case; do ' &
      //'not edit.', &
      '`./mics --help GROUP` prints the same. `docs/mics-case.schema.json` holds it as a JSON ' &
      //'schema: the', &
      'page of `mics-tools report` takes the defaults from it, and Python checks a case by it ' &
      //'with the', &
      'packages f90nml and jsonschema:', &
      '', &
      '```python', &
      'import json, f90nml, jsonschema', &
      'case = f90nml.read(''input/blocks.nml'')', &
      'case = {k: [dict(g) for g in v] if isinstance(v, list) else dict(v)', &
      '        for k, v in case.items()}', &
      'jsonschema.validate(case, json.load(open(''docs/mics-case.schema.json'')))', &
      '```', &
      '', &
      'SI units; angles in degrees where a name ends in `_deg`.']

    do i = 1, size(head)
      call lines%add_line(trim(head(i)))
    end do
    do g = 1, size(group_names)
      call list_entries(group_names(g), v)
      call lines%add_line(new_line('a')//'## &'//v%group%name//new_line('a'))
      text = v%meaning
      if (text(1:1) >= 'a') text(1:1) = achar(iachar(text(1:1)) - 32)
      if (is_repeated(g)) text = text//'; a case may hold any number of these groups'
      call lines%add_line(text//'.'//new_line('a'))
      call lines%add_line('| variable | values | default | unit | meaning | example |')
      call lines%add_line('|---|---|---|---|---|---|')
      do i = 1, v%n
        associate (entry => v%entry(i))
          default = default_words(entry)
          if (index(default, 'default ') == 1) default = '`'//entry%value()//'`'
          call lines%add_line('| `'//trim(entry%name)//'` | '//values(entry, with_unit=.false.) &
            //' | '//default//' | '//trim(entry%allowed%unit)//' | '//entry%meaning//' | `' &
            //entry%example//'` |')
        end associate
      end do
    end do
    text = lines%text()
  end function page_text

  !> The default, or why there is none.
  pure function default_words(entry) result(words)
    type(entry_t), intent(in) :: entry
    character(:), allocatable :: words

    words = 'default '//entry%value()
    if (len(entry%value()) == 0) words = 'no default'
    if (entry%required) words = 'required'
  end function default_words

  !> What a variable may be.
  pure function values(entry, with_unit) result(words)
    type(entry_t), intent(in) :: entry
    logical, intent(in) :: with_unit
    character(:), allocatable :: words

    select case (entry%kind)
    case ('choice'); words = choices(words_of(entry%choices))
    case ('logical'); words = '.true. or .false.'
    case ('number')
      associate (allowed => entry%allowed)
        words = 'number'
        if (allowed%whole) words = 'whole number'
        if (entry%most > 1) words = to_text(entry%most)//' '//words//'s'
        if (allowed%fewest > 0) words = to_text(allowed%fewest)//' to '//words
        if (with_unit .and. allowed%unit /= '') words = words//' ['//trim(allowed%unit)//']'
        if (allowed%bounded_below()) words = words//', '//allowed%words()
      end associate
    case default
      words = trim(entry%kind)
      if (entry%most > 1) words = '1 to '//to_text(entry%most)//' '//words//'s'
    end select
  end function values

end module reference_m
