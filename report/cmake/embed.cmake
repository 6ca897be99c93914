# Turns a text file into a C++ source that defines one string of assets.hpp:
#   cmake -DNAME=kPage -DINPUT=page.html -DOUTPUT=kPage.cpp -P embed.cmake
file(READ "${INPUT}" text)
set(delimiter "trihedron_asset")
if(text MATCHES "\\)${delimiter}\"")
  message(FATAL_ERROR "${INPUT} holds the delimiter of its own literal")
endif()
file(WRITE "${OUTPUT}" "#include \"assets.hpp\"\n\n"
  "const std::string_view trihedron::report::assets::${NAME} = R\"${delimiter}(${text})${delimiter}\";\n")
