#pragma once
/// Text into HTML, safely.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace trihedron::report {

/// `text` for the content of an element or a quoted attribute; what cannot be shown is made printable.
[[nodiscard]] std::string escaped(std::string_view text);

/// JSON for the inside of a script element: holds no '<', so that nothing in it ends the element.
[[nodiscard]] std::string script_safe(const nlohmann::json& data);

/// Fills in a Mustache template: {{name}} escaped, {{{name}}} as it is, {{.}} the value itself, {{#name}} … {{/name}}
/// once per element of an array, or once with an object, true or a string that is not empty, {{^name}} … {{/name}}
/// otherwise. A name is looked for in the inner value first, then outwards. Throws std::invalid_argument for a variable
/// that is nowhere, or a section without end: a fault of the template, never of the data.
[[nodiscard]] std::string fill_in(std::string_view page, const nlohmann::json& values);

}  // namespace trihedron::report
