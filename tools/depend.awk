# Dependencies of Fortran sources from their `use` lines, as make rules.
#
# awk -v B=build/serial -f tools/depend.awk src/*.f90 src/*/*.f90 verification/unit/*.f90
#
# For each source: the objects whose modules it uses. For each program: the variable OBJECTS_name
# with every object it needs, found by following the uses, with the submodules of what is used.
# Unknown modules (intrinsic, HDF5, MPI) come with the compiler.
function object(file) {
  sub(/.*\//, "", file)
  sub(/\.f90$/, "", file)
  return B "/" file ".o"
}

FNR == 1 { files[++n] = FILENAME }

{ line = tolower($0); sub(/!.*/, "", line) }

line ~ /^[ \t]*module[ \t]+[a-z0-9_]+[ \t]*$/ {
  split(line, word, " ")
  home[word[2]] = FILENAME
}

line ~ /^[ \t]*submodule[ \t]*\([a-z0-9_]+\)/ {
  split(line, word, /[()]/)
  uses[FILENAME] = uses[FILENAME] " " word[2]
  parts[word[2]] = parts[word[2]] " " FILENAME
}

line ~ /^[ \t]*program[ \t]+[a-z0-9_]+[ \t]*$/ {
  split(line, word, " ")
  program[FILENAME] = word[2]
}

line ~ /^[ \t]*use([ \t]|,|::)/ {
  sub(/^[ \t]*use[ \t]*/, "", line)
  sub(/^.*::[ \t]*/, "", line)
  split(line, word, /[ \t,]/)
  uses[FILENAME] = uses[FILENAME] " " word[1]
}

function follow(file, list, i, count) {
  if (file in reached) return
  reached[file] = 1
  count = split(uses[file], list, " ")
  for (i = 1; i <= count; i++) {
    if (list[i] in home) follow(home[list[i]])
  }
  needed = needed " " object(file)
  count = split(parts_of[file], list, " ")
  for (i = 1; i <= count; i++) follow(list[i])
}

END {
  for (module in parts) parts_of[home[module]] = parts[module]
  for (i = 1; i <= n; i++) {
    rule = ""
    count = split(uses[files[i]], list, " ")
    for (j = 1; j <= count; j++) {
      if (!(list[j] in home)) continue
      other = home[list[j]]
      if (other != files[i]) rule = rule " " object(other)
    }
    if (rule != "") print object(files[i]) ":" rule
    if (files[i] in program) {
      for (file in reached) delete reached[file]
      needed = ""
      follow(files[i])
      print "OBJECTS_" program[files[i]] " :=" needed
    }
  }
}
