!> What the program says of its case files: the variables of a group for people, all groups as a
!! JSON schema for programs. Both come from the procedures that read a case.
!!
!! In the schema a case is an object of groups, a group an object of variables; several groups of
!! one name are an array of objects, a list of values is an array. Reports take the defaults from
!! it, and `tools/write_reference.py` makes the page docs/reference.md of both.
module reference_m
  use kinds_m, only: name_length
  use allowed_values_m, only: entry_t, choices
  use group_visitor_m, only: group_visitor_t
  use string_builder_m, only: string_builder_t
  use case_input_m, only: group_names, first_repeated, list_entries
  use errors_m, only: problems_t, to_text
  use value_text_m, only: lower_case, nearest_name, printable, words_of
  implicit none
  private
  public :: reference_text

  integer, parameter :: width = 96    !! columns of the help
  character(*), parameter :: line_end = new_line('a')

contains

  !> The help on a topic: all groups in a line each (''), the variables of one group (its name), or
  !! the schema ('json'). Another topic is a problem, reported with the nearest group.
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
      text = 'Groups of a case (* any number); --help GROUP lists the variables:'//line_end
      do g = 1, size(group_names)
        call list_entries(group_names(g), v)
        name = group_names(g)(:12)
        if (g >= first_repeated) name = trim(name)//' *'
        text = text//'  '//name//v%meaning//line_end
      end do
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
    character(:), allocatable :: default
    integer :: i, indent

    call list_entries(group_names(g), v)
    call lines%add_line('&'//v%group%name//': '//v%meaning)
    if (g >= first_repeated) call lines%add_line('A case may hold any number of these groups.')
    indent = maxval(len_trim(v%entry(:v%n)%name)) + 4
    do i = 1, v%n
      associate (entry => v%entry(i))
        default = 'default '//entry%value()
        if (len(entry%value()) == 0) default = 'no default'
        if (entry%required) default = 'required'
        call lines%add_line('')
        call lines%add_line('  '//entry%name(:indent - 2) &
          //wrapped(values(entry)//'; '//default, indent))
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
      lines = lines//text(first:last - 1)//line_end//repeat(' ', indent)
      first = last + 1
    end do
    lines = lines//text(first:)
  end function wrapped

  !> What a variable may be.
  pure function values(entry) result(words)
    type(entry_t), intent(in) :: entry
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
        if (allowed%unit /= '') words = words//' ['//trim(allowed%unit)//']'
        if (allowed%low > -huge(allowed%low)) words = words//', '//allowed%words()
      end associate
    case default
      words = trim(entry%kind)
      if (entry%most > 1) words = '1 to '//to_text(entry%most)//' '//words//'s'
    end select
  end function values

  !> The schema of all groups.
  function schema_text() result(text)
    character(:), allocatable :: text
    type(group_visitor_t) :: v
    character(:), allocatable :: name, place, places, groups, needed
    integer :: g

    places = ''
    groups = ''
    needed = ''
    do g = 1, size(group_names)
      name = trim(group_names(g))
      call list_entries(name, v)
      groups = groups//','//line_end//'  "'//name//'": '//group_schema(v)
      place = '{"$ref": "#/$defs/'//name//'"}'
      if (g >= first_repeated) then
        place = '{"anyOf": ['//place//', {"type": "array", "items": '//place//'}]}'
      else if (any(v%entry(:v%n)%required)) then
        needed = needed//' '//name
      end if
      places = places//','//line_end//'  "'//name//'": '//place
    end do
    text = '{"$schema": "https://json-schema.org/draft/2020-12/schema",'//line_end &
      //'"title": "Case file of mics",'//line_end &
      //'"description": "Written by make reference; do not edit.",'//line_end &
      //'"type": "object", "additionalProperties": false, "required": ' &
      //strings(needed(2:))//','//line_end//'"properties": {'//places(2:)//'},'//line_end &
      //'"$defs": {'//groups(2:)//'}}'//line_end
  end function schema_text

  !> The schema of a group, a variable in each line.
  function group_schema(v) result(text)
    type(group_visitor_t), intent(in) :: v
    character(:), allocatable :: text
    character(:), allocatable :: needed, rules
    integer :: i

    needed = ''
    rules = ''
    do i = 1, v%n
      associate (entry => v%entry(i))
        rules = rules//','//line_end//'    "'//trim(entry%name)//'": {"description": ' &
          //quoted(entry%with_unit())//', '//value_schema(entry)
        if (entry%allowed%unit /= '') rules = rules//', "unit": "'//trim(entry%allowed%unit)//'"'
        if (entry%required) then
          needed = needed//' '//trim(entry%name)
        else if (len(entry%value()) > 0) then
          rules = rules//', "default": '//json(entry%value(), entry%most > 1)
        end if
        rules = rules//', "examples": ['//json(entry%example(index(entry%example, ' = ', &
          back=.true.) + 3:), entry%most > 1)//']}'
      end associate
    end do
    text = '{"type": "object", "additionalProperties": false, "description": '//quoted(v%meaning)
    if (v%ways /= '') then
      text = text//', "anyOf": [{"required": ' &
        //replaced(strings(v%ways), '|', '"]}, {"required": ["')//'}]'
    else if (needed /= '') then
      text = text//', "required": '//strings(needed(2:))
    end if
    text = text//', "properties": {'//rules(2:)//'}}'
  end function group_schema

  !> What the values of a variable may be.
  pure function value_schema(entry) result(text)
    type(entry_t), intent(in) :: entry
    character(:), allocatable :: text
    character(:), allocatable :: one, fewest

    select case (entry%kind)
    case ('logical'); text = '"type": "boolean"'
    case ('name'); text = '"type": "string", "minLength": 1, "maxLength": '//to_text(name_length)
    case ('choice'); text = '"enum": '//strings(entry%choices)
    case ('number')
      associate (allowed => entry%allowed)
        text = '"type": "number"'
        if (allowed%whole) text = '"type": "integer"'
        one = ', "exclusiveMinimum": '
        if (allowed%with_low) one = ', "minimum": '
        if (allowed%low > -huge(allowed%low)) text = text//one//to_text(allowed%low)
        if (allowed%high < huge(allowed%high)) text = text//', "maximum": '//to_text(allowed%high)
      end associate
    case default; text = '"type": "string"'
    end select
    if (entry%most == 1) return
    one = text
    fewest = to_text(merge(entry%allowed%fewest, entry%most, entry%allowed%fewest > 0))
    text = '"type": "array", "items": {'//one//'}, "minItems": '//fewest//', "maxItems": ' &
      //to_text(entry%most)
    if (entry%allowed%fewest == 1) text = '"anyOf": [{'//one//'}, {'//text//'}]'
  end function value_schema

  !> A value of a case file in JSON: text, a logical, a number or a list of numbers or names.
  pure function json(value, list) result(text)
    character(*), intent(in) :: value
    logical, intent(in) :: list
    character(:), allocatable :: text

    text = replaced(value, "'", '"')
    if (value(1:1) == '.') text = value(2:len(value) - 1)
    if (list .and. index(value, ',') > 0) text = '['//text//']'
  end function json

  !> A list of words, one blank between them, in JSON.
  pure function strings(words) result(text)
    character(*), intent(in) :: words
    character(:), allocatable :: text

    text = '["'//replaced(words, ' ', '", "')//'"]'
  end function strings

  !> A string between double quotes. The texts of the groups hold nothing that must be escaped
  !! but double quotes and backslashes.
  pure function quoted(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text

    text = '"'//replaced(replaced(raw, '\', '\\'), '"', '\"')//'"'
  end function quoted

  !> A text with another one for each letter of a kind.
  pure function replaced(raw, letter, by) result(text)
    character(*), intent(in) :: raw, by
    character(1), intent(in) :: letter
    character(:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, len(raw)
      if (raw(i:i) == letter) then
        text = text//by
      else
        text = text//raw(i:i)
      end if
    end do
  end function replaced

end module reference_m
