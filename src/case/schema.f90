!> The groups of a case as a JSON schema, for programs: reports take the defaults from it, and a
!! case that is read as JSON can be checked by it.
!!
!! A case is an object of groups, a group an object of variables; several groups of one name are
!! an array of objects, a list of values is an array.
module schema_m
  use kinds_m, only: name_length
  use errors_m, only: to_text
  use string_builder_m, only: string_builder_t
  use allowed_values_m, only: entry_t
  use group_visitor_m, only: group_visitor_t
  use case_input_m, only: group_names, is_repeated, list_entries
  implicit none
  private
  public :: schema_text

contains

  !> The schema of all groups.
  function schema_text() result(text)
    character(:), allocatable :: text
    type(string_builder_t) :: lines, places, groups
    type(group_visitor_t) :: v
    character(:), allocatable :: name, needed, comma
    integer :: g

    needed = ''
    do g = 1, size(group_names)
      name = trim(group_names(g))
      comma = trim(merge(', ', '  ', g < size(group_names)))
      call list_entries(name, v)
      call add_group(v, groups)
      call groups%add_line('    }'//comma)
      text = '{"$ref": "#/$defs/'//name//'"}'
      if (is_repeated(g)) then
        text = '{"anyOf": ['//text//', {"type": "array", "items": '//text//'}]}'
      else if (any(v%entry(:v%n)%required)) then
        needed = needed//' '//name
      end if
      call places%add_line('    "'//name//'": '//text//comma)
    end do
    call lines%add_line('{')
    call lines%add_line('  "$schema": "https://json-schema.org/draft/2020-12/schema",')
    call lines%add_line('  "title": "Case file of mics",')
    call lines%add_line('  "description": "Written by make reference; do not edit.",')
    call lines%add_line('  "type": "object",')
    call lines%add_line('  "properties": {')
    call lines%add(places%text())
    call lines%add_line('  },')
    call lines%add_line('  "required": '//strings(needed(2:), ' ')//',')
    call lines%add_line('  "additionalProperties": false,')
    call lines%add_line('  "$defs": {')
    call lines%add(groups%text())
    call lines%add_line('  }')
    call lines%add_line('}')
    text = lines%text()
  end function schema_text

  !> The definition of a group, but for its closing brace.
  subroutine add_group(v, lines)
    type(group_visitor_t), intent(in) :: v
    type(string_builder_t), intent(inout) :: lines
    character(:), allocatable :: needed, ways
    integer :: i, bar

    needed = ''
    call lines%add_line('    "'//v%group%name//'": {')
    call lines%add_line('      "type": "object",')
    call lines%add_line('      "description": '//quoted(v%meaning)//',')
    call lines%add_line('      "properties": {')
    do i = 1, v%n
      call lines%add_line('        "'//trim(v%entry(i)%name)//'": {')
      call lines%add_line('          "description": '//quoted(v%entry(i)%with_unit())//',')
      call lines%add_line('          '//values(v%entry(i))//extras(v%entry(i)))
      call lines%add_line('        }'//trim(merge(', ', '  ', i < v%n)))
      if (v%entry(i)%required) needed = needed//' '//trim(v%entry(i)%name)
    end do
    call lines%add_line('      },')
    if (v%ways /= '') then
      ways = ''
      needed = v%ways//'|'
      do while (needed /= '')
        bar = index(needed, '|')
        ways = ways//', {"required": '//strings(needed(:bar - 1), ' ')//'}'
        needed = needed(bar + 1:)
      end do
      call lines%add_line('      "anyOf": ['//ways(3:)//'],')
    else if (needed /= '') then
      call lines%add_line('      "required": '//strings(needed(2:), ' ')//',')
    end if
    call lines%add_line('      "additionalProperties": false')
  end subroutine add_group

  !> What the values of a variable may be.
  pure function values(entry) result(text)
    type(entry_t), intent(in) :: entry
    character(:), allocatable :: text
    character(:), allocatable :: one, fewest

    select case (entry%kind)
    case ('logical'); text = '"type": "boolean"'
    case ('name'); text = '"type": "string", "minLength": 1, "maxLength": '//to_text(name_length)
    case ('choice'); text = '"enum": '//strings(entry%choices, ' ')
    case ('number')
      associate (allowed => entry%allowed)
        text = '"type": "number"'
        if (allowed%whole) text = '"type": "integer"'
        one = ', "exclusiveMinimum": '
        if (allowed%with_low) one = ', "minimum": '
        if (allowed%bounded_below()) text = text//one//to_text(allowed%low)
        if (allowed%bounded_above()) text = text//', "maximum": '//to_text(allowed%high)
      end associate
    case default; text = '"type": "string"'
    end select
    if (entry%most == 1) return
    one = text
    fewest = to_text(merge(entry%allowed%fewest, entry%most, entry%allowed%fewest > 0))
    text = '"type": "array", "items": {'//one//'}, "minItems": '//fewest//', "maxItems": ' &
      //to_text(entry%most)
    if (entry%allowed%fewest == 1) text = '"anyOf": [{'//one//'}, {'//text//'}]'
  end function values

  !> Unit, default and example; a comma in front of each.
  pure function extras(entry) result(text)
    type(entry_t), intent(in) :: entry
    character(:), allocatable :: text
    integer :: value

    text = ''
    if (entry%allowed%unit /= '') text = ', "unit": "'//trim(entry%allowed%unit)//'"'
    if (len(entry%value()) > 0 .and. .not. entry%required) then
      text = text//', "default": '//json(entry%value(), entry%most > 1)
    end if
    value = index(entry%example, ' = ', back=.true.) + 3
    text = text//', "examples": ['//json(entry%example(value:), entry%most > 1)//']'
  end function extras

  !> A value of a case file in JSON: text, a logical, a number or a list of numbers or names.
  pure function json(value, list) result(text)
    character(*), intent(in) :: value
    logical, intent(in) :: list
    character(:), allocatable :: text

    select case (value(1:1))
    case ('''')
      text = quoted(value(2:len(value) - 1))
      if (list .and. index(value, ''', ''') > 0) text = strings(value(2:len(value) - 1), ''', ''')
    case ('.')
      text = value(2:len(value) - 1)
    case default
      text = value
      if (list .and. index(value, ',') > 0) text = '['//value//']'
    end select
  end function json

  !> A list of words in JSON.
  pure function strings(words, separator) result(text)
    character(*), intent(in) :: words, separator
    character(:), allocatable :: text
    integer :: first, length

    text = '['
    first = 1
    do
      length = index(words(first:), separator) - 1
      if (length < 0) exit
      text = text//'"'//words(first:first + length - 1)//'", '
      first = first + length + len(separator)
    end do
    text = text//'"'//words(first:)//'"]'
  end function strings

  !> A string between double quotes. The texts of the groups hold nothing that must be escaped
  !! but double quotes and backslashes.
  pure function quoted(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text
    integer :: i

    text = '"'
    do i = 1, len(raw)
      if (scan(raw(i:i), '"\') == 1) text = text//'\'
      text = text//raw(i:i)
    end do
    text = text//'"'
  end function quoted

end module schema_m
