# Completion of polyest and polyestd in bash. Asks the programs' own --help, so that it is never
# behind them: commands, options, the words that an option takes, and else the names of files.

# The commands that a help text lists: "  estimate     Estimate from a data file".
_polyest_commands() { # HELP
  awk '/^[A-Z]/ { arguments = tolower($0) ~ /^(positionals|arguments)/ }
    !arguments && /^  [a-z][a-z-]*  / { print $1 }' <<<"$1"
}

# The long options that it lists.
_polyest_options() { # HELP
  sed -n 's/^ *\(-[a-zA-Z], *\)\{0,1\}\(--[a-z0-9-]*\).*/\2/p' <<<"$1"
}

# The words that it lists for one option: "--log-format TEXT:{text,json}", or in its description
# "How to print: table, json (default table)" or "The decimal mark: comma, point".
_polyest_words() { # HELP OPTION
  awk -v option="$2" '
    /^ *-/ { inside = match($0, /--[a-z0-9-]+/) && substr($0, RSTART, RLENGTH) == option }
    /^[^ ]/ { inside = 0 }
    inside { text = text " " $0 }
    END {
      gsub(/ +/, " ", text)
      if (match(text, /[{][^}]*[}]/)) words = substr(text, RSTART + 1, RLENGTH - 2)
      else if (match(text, /: [a-z0-9-]+(, [a-z0-9-]+)+( [(]| ?$)/)) {
        words = substr(text, RSTART + 2, RLENGTH - 2)
      }
      gsub(/[,(]/, " ", words)
      print words
    }' <<<"$1"
}

_polyest() {
  local program=${COMP_WORDS[0]} current=${COMP_WORDS[COMP_CWORD]}
  local previous=${COMP_WORDS[COMP_CWORD - 1]} help words
  help=$("$program" --help 2>/dev/null) || return
  words=$(_polyest_commands "$help")
  if [[ -n $words && $COMP_CWORD -gt 1 ]]; then
    # The command's own help, if there is such a command.
    grep -qxF -- "${COMP_WORDS[1]}" <<<"$words" || return
    help=$("$program" "${COMP_WORDS[1]}" --help 2>/dev/null) || return
    words=""
  fi
  if [[ $previous == --* ]]; then
    local choices
    choices=$(_polyest_words "$help" "$previous")
    if [[ -n $choices ]]; then
      mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
      return
    fi
  fi
  if [[ -n $words || $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words $(_polyest_options "$help")" -- "$current")
  fi
}

# Where nothing of the programs' own fits, bash proposes files.
complete -o default -F _polyest polyest polyestd
