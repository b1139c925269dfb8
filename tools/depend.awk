# Dependencies of Fortran sources from their `use` lines, as make rules.
#
# awk -v B=build/serial -v C=build/common -f tools/depend.awk src/*.f90 src/*/*.f90 ...
#
# For each source: the objects whose modules it uses, in C if neither it nor any of them uses HDF5
# or MPI, else in B. For each program: the variable OBJECTS_name with every object it needs, found
# by following the uses, with the submodules of what is used. ELSEWHERE: all objects, in the folder
# where they are not. Other unknown modules come with the compiler.
function name(file) {
  sub(/.*\//, "", file)
  sub(/\.f90$/, "", file)
  return file ".o"
}

function object(file) { return (bound(file) ? B : C) "/" name(file) }

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

# Does a source know HDF5 or MPI, by itself or through what it uses?
function bound(file, list, i, count) {
  if (file in known) return known[file]
  known[file] = uses[file] " " ~ / (hdf5|mpi_f08) /
  count = split(uses[file], list, " ")
  for (i = 1; i <= count; i++) {
    if (list[i] in home && bound(home[list[i]])) known[file] = 1
  }
  return known[file]
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
    elsewhere = elsewhere " " (bound(files[i]) ? C : B) "/" name(files[i])
  }
  print "ELSEWHERE :=" elsewhere
}
