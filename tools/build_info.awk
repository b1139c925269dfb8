# A Fortran module that tells how the program was built.
#
# awk -v version=... -v revision=... -v flags=... -f tools/build_info.awk < /dev/null

# A character constant, cut into pieces so that no line passes 100 columns.
function constant(name, text, rest, out) {
  gsub(/'/, "''", text)
  out = "  character(*), parameter :: " name " = &\n"
  rest = text
  while (length(rest) > 60) {
    out = out "    '" piece(rest) "'// &\n"
    rest = substr(rest, length(piece(rest)) + 1)
  }
  return out "    '" rest "'\n"
}

# The first sixty characters, not ending between the two halves of a doubled quote.
function piece(text, part, tail) {
  part = substr(text, 1, 60)
  tail = part
  sub(/'*$/, "", tail)
  if ((length(part) - length(tail)) % 2 == 1) part = substr(part, 1, length(part) - 1)
  return part
}

END {
  print "!> How this program was built; written by the Makefile."
  print "module build_info_m"
  print "  use, intrinsic :: iso_fortran_env, only: compiler_version"
  print "  implicit none"
  print "  private"
  print "  public :: version, git_revision, compiler, flags"
  print ""
  print "  character(*), parameter :: compiler = compiler_version()"
  printf "%s", constant("version", version)
  printf "%s", constant("git_revision", revision)
  printf "%s", constant("flags", flags)
  print ""
  print "end module build_info_m"
}
