!> The groups of a case as a JSON schema, for programs: reports take the defaults from it, and a
!! case that is read as JSON can be checked by it.
!!
!! A case is an object of groups, a group an object of variables; several groups of one name are
!! an array of objects, a list of values is an array.
module schema_m
  use kinds_m, only: name_length
  use errors_m, only: to_text
  use string_builder_m, only: string_builder_t
  use description_m, only: group_description_t, variable_t
  implicit none
  private
  public :: schema_text

contains

  !> The schema of all groups.
  pure function schema_text(groups) result(text)
    type(group_description_t), intent(in) :: groups(:)
    character(:), allocatable :: text
    type(string_builder_t) :: lines
    character(:), allocatable :: needed
    integer :: g

    needed = ''
    call lines%add_line('{')
    call lines%add_line('  "$schema": "https://json-schema.org/draft/2020-12/schema",')
    call lines%add_line('  "title": "Case file of mics",')
    call lines%add_line('  "description": "Written by make reference; do not edit.",')
    call lines%add_line('  "type": "object",')
    call lines%add_line('  "properties": {')
    do g = 1, size(groups)
      call lines%add_line('    '//place_of_group(groups(g))//comma(g, size(groups)))
      if (any(groups(g)%variable(:groups(g)%n)%required) .and. .not. groups(g)%repeated) then
        needed = needed//', '//quoted(trim(groups(g)%name))
      end if
    end do
    call lines%add_line('  },')
    call lines%add_line('  "required": ['//needed(3:)//'],')
    call lines%add_line('  "additionalProperties": false,')
    call lines%add_line('  "$defs": {')
    do g = 1, size(groups)
      call add_group(groups(g), lines)
      call lines%add_line('    }'//comma(g, size(groups)))
    end do
    call lines%add_line('  }')
    call lines%add_line('}')
    text = lines%text()
  end function schema_text

  !> Where a group stands in a case: once, or any number of times.
  pure function place_of_group(group) result(text)
    type(group_description_t), intent(in) :: group
    character(:), allocatable :: text
    character(:), allocatable :: reference

    reference = '{"$ref": "#/$defs/'//trim(group%name)//'"}'
    text = quoted(trim(group%name))//': '
    if (group%repeated) then
      text = text//'{"anyOf": ['//reference//', {"type": "array", "items": '//reference//'}]}'
    else
      text = text//reference
    end if
  end function place_of_group

  !> The definition of a group, but for its closing brace.
  pure subroutine add_group(group, lines)
    type(group_description_t), intent(in) :: group
    type(string_builder_t), intent(inout) :: lines
    character(:), allocatable :: needed
    integer :: i

    needed = ''
    call lines%add_line('    '//quoted(trim(group%name))//': {')
    call lines%add_line('      "type": "object",')
    call lines%add_line('      "description": '//quoted(group%meaning)//',')
    call lines%add_line('      "properties": {')
    do i = 1, group%n
      associate (variable => group%variable(i))
        call lines%add_line('        '//quoted(variable%name)//': {')
        call lines%add_line('          "description": '//quoted(with_unit(variable))//',')
        call lines%add_line('          '//values(variable)//extras(variable))
        call lines%add_line('        }'//comma(i, group%n))
        if (variable%required) needed = needed//', '//quoted(variable%name)
      end associate
    end do
    call lines%add_line('      },')
    select case (group%name)
    case ('body')
      call lines%add_line('      "anyOf": ['//needs('shape position')//', ' &
        //needs('shape motion')//'],')
    case ('drop')
      call lines%add_line('      "anyOf": ['//needs('shape position')//', ' &
        //needs('shapes position')//', '//needs('file')//'],')
    case default
      if (len(needed) > 0) call lines%add_line('      "required": ['//needed(3:)//'],')
    end select
    call lines%add_line('      "additionalProperties": false')
  end subroutine add_group

  !> One of several ways to give what a group needs.
  pure function needs(names) result(text)
    character(*), intent(in) :: names   !! separated by blanks
    character(:), allocatable :: text

    text = '{"required": ['//words_json(names)//']}'
  end function needs

  !> Meaning and unit, for editors that show only the description.
  pure function with_unit(variable) result(text)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: text

    text = variable%meaning
    if (variable%kind /= 'number') return
    if (len(variable%allowed%unit) > 0) text = text//' ['//variable%allowed%unit//']'
  end function with_unit

  !> What the values of a variable may be.
  pure function values(variable) result(text)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: text
    character(:), allocatable :: fewest

    select case (variable%kind)
    case ('logical'); text = '"type": "boolean"'
    case ('name')
      text = '"type": "string", "minLength": 1, "maxLength": '//to_text(name_length)
      if (variable%most > 1) text = '"anyOf": [{'//text//'}, {"type": "array", "items": {'//text &
        //'}, "minItems": 1, "maxItems": '//to_text(variable%most)//'}]'
    case ('choice'); text = '"enum": ['//words_json(variable%choices)//']'
    case ('number')
      text = number(variable)
      if (variable%most == 1) return
      fewest = to_text(variable%most)
      if (variable%allowed%fewest > 0) fewest = to_text(variable%allowed%fewest)
      text = '"type": "array", "items": {'//text//'}, "minItems": '//fewest//', "maxItems": ' &
        //to_text(variable%most)
      if (variable%allowed%fewest == 1) text = '"anyOf": [{'//number(variable)//'}, {'//text//'}]'
    case default; text = '"type": "string"'
    end select
  end function values

  !> One number with its bounds.
  pure function number(variable) result(text)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: text

    associate (allowed => variable%allowed)
      text = '"type": "number"'
      if (allowed%whole) text = '"type": "integer"'
      if (allowed%bounded_below() .and. allowed%with_low) then
        text = text//', "minimum": '//to_text(allowed%low)
      else if (allowed%bounded_below()) then
        text = text//', "exclusiveMinimum": '//to_text(allowed%low)
      end if
      if (allowed%bounded_above()) text = text//', "maximum": '//to_text(allowed%high)
    end associate
  end function number

  !> Unit, default and example; a comma in front of each.
  pure function extras(variable) result(text)
    type(variable_t), intent(in) :: variable
    character(:), allocatable :: text
    integer :: value

    text = ''
    if (variable%kind == 'number') then
      if (len(variable%allowed%unit) > 0) text = ', "unit": '//quoted(variable%allowed%unit)
    end if
    if (len(variable%value) > 0 .and. .not. variable%required) then
      text = text//', "default": '//json(variable%value, variable%most > 1)
    end if
    value = index(variable%example, ' = ', back=.true.) + 3
    text = text//', "examples": ['//json(variable%example(value:), variable%most > 1)//']'
  end function extras

  !> A value of a case file in JSON: text, a logical, a number or a list of numbers.
  pure function json(value, list) result(text)
    character(*), intent(in) :: value
    logical, intent(in) :: list
    character(:), allocatable :: text
    integer :: part

    select case (value(1:1))
    case ('''')
      part = index(value, ''', ''')
      if (list .and. part > 0) then   ! two words
        text = '['//quoted(value(2:part - 1))//', '//quoted(value(part + 4:len(value) - 1))//']'
      else
        text = quoted(value(2:len(value) - 1))
      end if
    case ('.')
      text = value(2:len(value) - 1)
    case default
      text = value
      if (list .and. index(value, ',') > 0) text = '['//value//']'
    end select
  end function json

  !> Words with a blank between them, as strings with commas between them.
  pure function words_json(words) result(text)
    character(*), intent(in) :: words
    character(:), allocatable :: text
    integer :: i

    text = '"'
    do i = 1, len(words)
      if (words(i:i) == ' ') then
        text = text//'", "'
      else
        text = text//words(i:i)
      end if
    end do
    text = text//'"'
  end function words_json

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

  !> A comma after all but the last.
  pure function comma(i, n) result(text)
    integer, intent(in) :: i, n
    character(:), allocatable :: text

    text = ','
    if (i == n) text = ''
  end function comma

end module schema_m
